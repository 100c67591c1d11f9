// Stopping on request: the first SIGINT or SIGTERM sets the flag of
// base/stop.h, so that completed work is committed. Another one, more than a
// second later, kills the process at once.

#pragma once

namespace enfilade {

// Installs the handlers for the whole process. Also ignores SIGXFSZ, so that a
// file size limit makes a write fail instead of killing the process.
void InstallStopHandlers();

}  // namespace enfilade
