#include <cstdio>

int main() {
  std::puts("scarp " SCARP_VERSION);
  return 0;
}
