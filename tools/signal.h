// Stopping on request: SIGINT and SIGTERM set the flag of base/stop.h, so that
// what was done is committed; another one, a second later, kills at once.

#pragma once

namespace enfilade {

// Installs the handlers for the whole process. Also ignores SIGXFSZ, so that
// a file size limit is an error of a write and not a death.
void InstallStopHandlers();

}  // namespace enfilade
