#include "cli/build/certified_settings.h"

namespace scarp {

HidingOptions hiding_options(const CertifiedSettings& settings) {
  HidingOptions options;
  options.fans = settings.fans;
  options.sectors = settings.sectors;
  options.width *= settings.patch;
  options.piece *= settings.patch;
  return options;
}

double least_bytes(std::uint32_t groups) {
  constexpr int kFewestSectors = 8;
  return static_cast<double>(groups) * kept_group_bytes(kFewestSectors);
}

}  // namespace scarp
