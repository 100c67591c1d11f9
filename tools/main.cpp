#include "tools/cli.h"

int main(int argc, char** argv) {
  return enfilade::RunCommandLine(argc, argv);
}
