#pragma once

#include <cstddef>
#include <cstdint>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"

namespace scarp {

/// What certified regions may take unless the user says otherwise, bytes a triangle of the mesh.
inline constexpr double kCertifiedBytes = 16;

/// What trades culled share for cost, as flags of build and as parameters of a scene. The same
/// settings and the same surface give the same bits; every setting is safe.
struct CertifiedSettings {
  int fans = HidingOptions{}.fans;        ///< of directions, a multiple of 8: time
  int sectors = HidingOptions{}.sectors;  ///< of camera azimuths, a multiple of 8: bytes
  double patch = 1;  ///< size of what is looked at at once, mean distances between vertices: time

  friend bool operator==(const CertifiedSettings&, const CertifiedSettings&) = default;
};

/// How the fans were chosen, where a budget chose them.
struct BudgetChoice {
  double seconds = 0;      ///< that were allowed
  double measured_s = 0;   ///< that measuring took
  double predicted_s = 0;  ///< of certifying
};

/// In the words of the core.
HidingOptions hiding_options(const CertifiedSettings& settings);

/// The least that regions of so many groups can take, bytes.
double least_bytes(std::uint32_t groups);

}  // namespace scarp
