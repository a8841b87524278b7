#pragma once

#include <string>
#include <vector>

#include "cli/fly/flight.h"

namespace scarp {

/// A line a frame and method.
std::string flight_csv(const Flight& flight, const std::vector<Contender>& contenders);

/// Charts of a flight on one page that needs nothing else: triangles, wrong pixels and times by
/// frame, and a table of the sums.
///
/// @param title     what was flown where
/// @param pictures  file names beside the page, with the contender that each belongs to
std::string flight_page(const Flight& flight, const std::vector<Contender>& contenders,
                        const std::string& title,
                        const std::vector<std::pair<std::string, std::string>>& pictures);

/// Sums over the frames of one contender.
struct FlightSum {
  double drawn = 0, in_view = 0, visible = 0, in_visible_groups = 0;  ///< mean triangles a frame
  double find_ms = 0, draw_ms = 0;                                    ///< medians
  std::array<std::uint64_t, kPictureScales.size()> wrong_px{}, judged_wrong_px{};
  std::uint64_t missed_groups = 0;
  std::uint64_t movers = 0, missed_movers = 0;  ///< of all frames
};
FlightSum sum_of(const Flight& flight, std::size_t contender);

}  // namespace scarp
