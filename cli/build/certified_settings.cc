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

std::size_t certified_bytes(const CertifiedRegions& regions) {
  return regions.groups.size() * sizeof(CertifiedGroup) +
         regions.steps.size() * sizeof(SectorSteps);
}

double least_bytes(std::uint32_t groups) {
  constexpr int kFewestSectors = 8;
  return static_cast<double>(groups) *
         static_cast<double>(sizeof(CertifiedGroup) + kFewestSectors * sizeof(SectorSteps));
}

}  // namespace scarp
