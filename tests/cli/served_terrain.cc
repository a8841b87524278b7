#include "tests/cli/served_terrain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/cli/written_dem.h"
#include "tests/support/run_scarp.h"

namespace scarp::test {
namespace {

constexpr int kColumns = 140, kRows = 120;

void write_hills(const std::string& path) {
  std::vector<float> heights(kColumns * kRows);
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const double hills = 300 * std::sin(c / 9.0) * std::cos(r / 7.0) +
                           90 * std::sin((c + 2 * r) / 5.0) + 4 * ((c * 7 + r * 13) % 11);
      heights[static_cast<std::size_t>(r * kColumns + c)] = static_cast<float>(1500 + hills);
      if (c > 100 && c < 108 && r > 20 && r < 30)
        heights[static_cast<std::size_t>(r * kColumns + c)] = -9999;
    }
  }
  // Around 473,150 E 5,155,050 N: 8.65 E, 46.55 N.
  write_dem(path,
            {.columns = kColumns,
             .rows = kRows,
             .left = 466'150,
             .top = 5'161'050,
             .cell_m = 100,
             .nodata = -9999},
            std::move(heights));
}

}  // namespace

ServedTerrain::ServedTerrain() {
  write_hills(dem());
  const RunResult built = run_scarp("$SCARP build " + dem() + " -o " + scene() +
                                    " --max-error 20 --fans 32 --sectors 16");
  EXPECT_EQ(built.exit_code, 0) << built.errors;
}

const ServedTerrain& ServedTerrain::get() {
  static const ServedTerrain terrain;
  return terrain;
}

ServeOptions TestServer::served() {
  ServeOptions options;
  options.sources = {ServedTerrain::get().dem(), ServedTerrain::get().scene()};
  options.common.memory_budget_bytes = std::uint64_t{1} << 30;
  options.port = 0;
  return options;
}

TestServer::TestServer(ServeOptions options, HttpLimits limits)
    : api_(std::make_unique<Api>(options)) {
  server_ = std::make_unique<HttpServer>(
      options.host, static_cast<std::uint16_t>(options.port), limits,
      [api = api_.get()](std::shared_ptr<const HttpRequest> request, Reply reply) {
        api->handle(std::move(request), std::move(reply));
      });
  api_->watch(*server_);
  thread_ = std::thread([this] { server_->run(); });
}

TestServer::~TestServer() {
  api_->close();
  server_->stop(std::chrono::seconds(5));
  thread_.join();
  api_->finish();
}

}  // namespace scarp::test
