#pragma once

#include <optional>
#include <string>

namespace scarp::test {

/// Path of a file of the shared data collection, such as "projected/bigtujunga_srtm30m_utm11.tif",
/// or nothing where the collection is not there. It is looked for in $SCARP_SHARED_DATA, then in
/// ../shared/data beside the checkout.
std::optional<std::string> shared_data(const std::string& name);

}  // namespace scarp::test

/// Skips the test, naming what is missing, where the shared data are not there.
#define SCARP_SHARED_OR_SKIP(variable, name)                                          \
  const auto variable##_found = ::scarp::test::shared_data(name);                     \
  if (!variable##_found) GTEST_SKIP() << "left out, shared data not found: " << name; \
  const std::string& variable = *variable##_found
