#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace scarp::test {

/// What is wanted of one setting: shares of hidden groups culled, by height, and what they may
/// cost.
inline constexpr double kWantedShare[] = {0.90, 0.90, 0.88, 0.85};
inline constexpr double kMostUs = 120;    ///< of processor, a triangle: a million in 60 s on two
inline constexpr double kMostBytes = 16;  ///< a triangle
inline constexpr double kMostOrphans = 0.03;
inline constexpr int kLeastMedianGroup = 64;
inline constexpr double kMostRuntimeUs = 100;  ///< of 10,000 groups
inline constexpr double kLeastOverSquares = 1.10;

/// A picture of share against processor time and against bytes, with what is wanted drawn in.
/// @param points  [{label, is_default, varies: "fans" or "bytes", us, bytes, share: [4]}]
std::string front_picture(const nlohmann::json& points, const std::string& title);

}  // namespace scarp::test
