// Writes the small culling files that are damaged by tests into a folder: seed FOLDER

#include <fstream>
#include <string>

#include "tests/tiles/runtime_bytes.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  int number = 0;
  for (const auto& bytes : scarp::test::small_culling_files()) {
    const std::string path = std::string(argv[1]) + "/" + std::to_string(number++) + ".scarp";
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    if (!file) return 1;
  }
  return 0;
}
