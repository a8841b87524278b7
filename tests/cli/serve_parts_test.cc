#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "cli/serve/byte_cache.h"
#include "cli/serve/compute_pool.h"
#include "cli/serve/json_schema.h"
#include "cli/serve/mercator.h"
#include "cli/serve/negotiation.h"
#include "cli/serve/problem.h"
#include "cli/serve/request_target.h"

namespace scarp {
namespace {

using nlohmann::json;

TEST(ServeTarget, IsCutBeforeItIsDecoded) {
  const auto target = parse_target("/a%20b/c?x=1%262&y=a+b&&z");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->segments, (std::vector<std::string>{"a b", "c"}));
  ASSERT_EQ(target->query.size(), 3U);
  EXPECT_EQ(target->query[0].second, "1&2");
  EXPECT_EQ(target->query[1].second, "a b");
  EXPECT_TRUE(parse_target("/")->segments.empty());
  EXPECT_EQ(parse_target("/%252e%252e")->segments[0], "%2e%2e");  // once, not twice
  for (const char* bad : {"", "a", "/..", "/a/%2e%2e/b", "/a%2fb", "/a%5Cb", "/%00", "/%0a", "/%",
                          "/%f", "/%gg", "/%c0%ae", "/%ed%a0%80", "/a?b=%00", "/./a"})
    EXPECT_FALSE(parse_target(bad)) << bad;
}

TEST(ServeNegotiation, TheMostPreciseRangeHasItsSay) {
  const std::vector<std::string> offers = {"application/json", "image/png", "image/tiff; x=y"};
  EXPECT_EQ(choose_media_type("", offers), 0U);
  EXPECT_EQ(choose_media_type("*/*", offers), 0U);
  EXPECT_EQ(choose_media_type("image/*", offers), 1U);
  EXPECT_EQ(choose_media_type("image/png;q=0.1, image/*;q=0.9", offers), 2U);
  EXPECT_EQ(choose_media_type("IMAGE/TIFF", offers), 2U);
  EXPECT_EQ(choose_media_type("text/html, */*;q=0.1", offers), 0U);
  EXPECT_FALSE(choose_media_type("text/html", offers));
  EXPECT_FALSE(choose_media_type("image/*;q=0, application/json;q=0", offers));
  const Preference preference = parse_prefer("return=minimal; x=\"a,b\", Respond-Async, wait=5");
  EXPECT_TRUE(preference.respond_async);
  EXPECT_TRUE(preference.return_minimal);
  EXPECT_EQ(preference.wait_s, 5);
  EXPECT_FALSE(parse_prefer("x=\"respond-async\"").respond_async);
}

TEST(ServeSchema, NamesTheFirstFault) {
  const json schema = json::parse(R"({"type":"object","required":["a"],"additionalProperties":false,
    "properties":{"a":{"type":"array","minItems":1,"maxItems":2,"items":{"type":"number","minimum":0,
    "maximum":9}},"b":{"oneOf":[{"type":"string","maxLength":3},{"type":"integer"}]},
    "c":{"type":"number","nullable":true},"d":{"enum":["x","y"]}}})");
  const auto fault = [&](const char* text) {
    return schema_fault(schema, json::parse(text), "").value_or("");
  };
  EXPECT_EQ(fault(R"({"a":[1,2],"b":"abc","c":null,"d":"y"})"), "");
  EXPECT_EQ(fault("{}"), "a: is missing");
  EXPECT_EQ(fault(R"({"a":[1,-2]})"), "a[1]: -2 is below the least allowed, 0");
  EXPECT_EQ(fault(R"({"a":[1,10]})"), "a[1]: 10 is above the most allowed, 9");
  EXPECT_NE(fault(R"({"a":[]})"), "");
  EXPECT_NE(fault(R"({"a":[1,2,3]})"), "");
  EXPECT_NE(fault(R"({"a":["1"]})"), "");
  EXPECT_NE(fault(R"({"a":[1],"b":"abcd"})"), "");
  EXPECT_NE(fault(R"({"a":[1],"b":1.5})"), "");
  EXPECT_EQ(fault(R"({"a":[1],"b":2.0})"), "");
  EXPECT_NE(fault(R"({"a":[1],"d":"z"})"), "");
  EXPECT_NE(fault(R"({"a":[1],"e":1})").find("known are a, b, c, d"), std::string::npos);
  EXPECT_NE(fault("[]"), "");
}

TEST(ServeSchema, RefusesWhatIsNoJson) {
  for (const std::string& bad :
       {std::string("{"), std::string("NaN"), std::string("[1e999]"), std::string(""),
        std::string(100'000, '['), std::string("\"\xff\""), std::string("{\"a\":1}x")})
    EXPECT_THROW(parse_json(bad), Refusal) << bad.substr(0, 10);
  EXPECT_EQ(parse_json("{\"a\":\"[[[[\"}")["a"], "[[[[");
}

TEST(ServeMercator, MapIsWithinAFiftiethOfACell) {
  // A conic-like map, bent more than any that is used over such a width.
  const auto place = [](LonLat at) -> std::optional<std::pair<double, double>> {
    const double turn = (at.longitude_deg - 8) * 0.7 * M_PI / 180;
    const double radius_m = (90 - at.latitude_deg) * 111'000, nearest_m = 43 * 111'000;
    return std::pair(radius_m * std::sin(turn) / 30, (radius_m * std::cos(turn) - nearest_m) / 30);
  };
  const MercatorPoint low = to_mercator({7.5, 46}), high = to_mercator({8.5, 47});
  const MercatorMap map({low.x_m, low.y_m, high.x_m, high.y_m}, 30, place);
  std::vector<RasterPlace> places(997);
  double most = 0;
  for (double y_m = low.y_m; y_m < high.y_m; y_m += 1234.5) {
    const double step_m = (high.x_m - low.x_m) / 1000;
    map.places(y_m, low.x_m, step_m, places);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto exact = place(to_lon_lat({low.x_m + static_cast<double>(i) * step_m, y_m}));
      most = std::max(most,
                      std::hypot(places[i].column - exact->first, places[i].row - exact->second));
    }
  }
  EXPECT_LT(most, 0.02);
  EXPECT_GT(most, 0);
  map.places(high.y_m + 1, low.x_m, 1, places);
  EXPECT_TRUE(std::isnan(places[0].column));
}

TEST(ServePool, ClientsTakeTurns) {
  ComputePool::Limits limits;
  limits.threads = 1;
  limits.waiting = 100;
  limits.waiting_of_client = 10;
  std::mutex mutex;
  std::condition_variable changed;
  bool is_open = false, is_begun = false;
  std::vector<std::string> order;
  std::atomic<int> dropped{0};
  ComputePool pool(limits);
  const auto task = [&](const std::string& client, bool waits) {
    PoolTask made;
    made.client = client;
    made.run = [&, client, waits] {
      std::unique_lock lock(mutex);
      is_begun = true;
      changed.notify_all();
      if (waits) changed.wait(lock, [&] { return is_open; });
      order.push_back(client);
      changed.notify_all();
    };
    made.refuse = [&](PoolTask::Why) { ++dropped; };
    return made;
  };
  ASSERT_TRUE(pool.submit(task("a", true)));
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return is_begun; });
  }
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(pool.submit(task("a", false)));
  EXPECT_FALSE(pool.submit(task("a", false)));  // as many as one client may
  ASSERT_TRUE(pool.submit(task("b", false)));
  PoolTask unwanted = task("c", false);
  unwanted.is_not_wanted = [] { return true; };
  ASSERT_TRUE(pool.submit(std::move(unwanted)));
  {
    const std::scoped_lock lock(mutex);
    is_open = true;
  }
  changed.notify_all();
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return order.size() == 12; });
  // The first of a, begun before; then a and b in turns, though ten of a came before b.
  EXPECT_EQ(order[1], "a");
  EXPECT_EQ(order[2], "b");
  EXPECT_EQ(dropped, 1);
}

TEST(ServePool, CloseRefusesWhatWaits) {
  ComputePool::Limits limits;
  limits.threads = 1;
  std::atomic<bool> is_open{false}, is_begun{false};
  std::atomic<int> ran{0}, refused{0};
  ComputePool pool(limits);
  PoolTask first;
  first.client = "a";
  first.run = [&] {
    is_begun = true;
    is_begun.notify_all();
    is_open.wait(false);
    ++ran;
  };
  first.refuse = [&](PoolTask::Why) { ++refused; };
  PoolTask second = first;
  ASSERT_TRUE(pool.submit(std::move(first)));
  is_begun.wait(false);
  ASSERT_TRUE(pool.submit(second));
  pool.close();
  EXPECT_EQ(refused, 1);
  EXPECT_FALSE(pool.submit(second));
  is_open = true;
  is_open.notify_all();
}

TEST(ServeCache, ForgetsTheLeastRecentlyUsed) {
  ByteCache<std::string> cache(1000);
  const auto value = std::make_shared<const std::string>("v");
  cache.put("a", value, 300);
  cache.put("b", value, 300);
  EXPECT_TRUE(cache.find("a"));
  cache.put("c", value, 300);
  EXPECT_TRUE(cache.find("a"));
  EXPECT_FALSE(cache.find("b"));
  EXPECT_LE(cache.counts().bytes, 1000U);
  cache.put("d", value, 2000);
  EXPECT_FALSE(cache.find("d"));
  cache.put("a", value, 100);
  EXPECT_EQ(cache.counts().entries, 2U);
}

}  // namespace
}  // namespace scarp
