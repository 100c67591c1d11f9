// Stopping on request: SIGINT and SIGTERM set a flag that long work looks at,
// so that what was done is committed; another one, a second later, kills at
// once.

#pragma once

#include <atomic>

namespace enfilade {

// Installs the handlers for the whole process. Also ignores SIGXFSZ, so that
// a file size limit is an error of a write and not a death.
void InstallStopHandlers();

// Set by the first SIGINT or SIGTERM; the flag lives as long as the process.
const std::atomic<bool>& StopRequested();

// Throws InterruptedError if a stop was requested.
void ThrowIfStopRequested();

}  // namespace enfilade
