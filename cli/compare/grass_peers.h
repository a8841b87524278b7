#pragma once

#include <optional>
#include <string>

#include "cli/compare/jobs.h"
#include "cli/temp_file.h"

namespace scarp {

/// What GRASS makes of the square, in a project of its own that is gone afterwards: r.viewshed and
/// r.horizon, timed without the program's start, reading and writing.
class GrassPeers {
 public:
  /// Nothing where GRASS is not installed, or would take degrees for metres.
  /// @param ground   kept by reference, like what is made
  /// @param why[out] where there is nothing
  static std::unique_ptr<GrassPeers> find(const ComparedGround& ground, std::string& why);

  ViewshedPeer viewshed() const;
  HorizonPeer horizon() const;

 private:
  explicit GrassPeers(const ComparedGround& ground);
  std::string viewshed_command(const ComparedGround::Eye& eye) const;
  std::vector<double> run(const std::string& timed, const std::string& then) const;

  const ComparedGround& ground_;
  TempFile square_{".tif"};
};

}  // namespace scarp
