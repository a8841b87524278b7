#include "cli/commands.h"

int main(int argc, char** argv) {
  return scarp::run_command_line(argc, argv);
}
