// Included once by each file that has the loops in a form of their own; no header of the project.
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

namespace scarp {
namespace {

class KernelRun {
 public:
  explicit KernelRun(std::uint32_t seed) : random_(seed) {}

  std::vector<std::uint8_t> run() {
    // Below, at and above the widths of all vectors, aligned and not.
    for (const std::size_t count : {5U, 7U, 8U, 15U, 16U, 17U, 33U, 64U, 100U, 1001U}) {
      pictures(count);
      bounds(count);
    }
    return bytes_;
  }

 private:
  template <typename Value>
  void keep(const std::vector<Value>& values) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(values.data());
    bytes_.insert(bytes_.end(), from, from + values.size() * sizeof(Value));
  }
  void keep(bool value) { bytes_.push_back(value ? 1 : 0); }

  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  std::vector<double> drawn(std::size_t count, double low, double high) {
    std::vector<double> values(count);
    for (double& value : values) value = low + (high - low) * unit();
    return values;
  }
  std::vector<float> drawn_floats(std::size_t count, double low, double high) {
    std::vector<float> values;
    for (const double value : drawn(count, low, high)) values.push_back(static_cast<float>(value));
    return values;
  }

  void pictures(std::size_t n) {
    std::vector<std::int32_t> steps(3 * n);
    for (std::int32_t& step : steps)
      step = unit() < 0.1 ? GroundGrid::kVoid : static_cast<std::int32_t>(8e6 * (unit() - 0.3));
    std::vector<double> z(n), across(n), down(n), raised(n);
    std::vector<std::uint8_t> is_void(n);
    for (const std::size_t stride : {1U, 3U}) {
      keep(load_heights(steps.data(), stride, n, z.data(), is_void.data()));
      keep(z);
      keep(is_void);
    }
    BlockPlacement::Block block;
    for (auto& quantity : block)
      for (double& k : quantity) k = 300 * (unit() - 0.5);
    for (double& k : block[BlockPlacement::kTiltX]) k *= 1e-6;
    for (double& k : block[BlockPlacement::kTiltY]) k *= 1e-6;
    for (double& k : block[BlockPlacement::kLift]) k *= 1e-4;
    for (double& k : block[BlockPlacement::kFall]) k *= 1e-9;
    block[BlockPlacement::kLift][0] += 1;
    PlanFrame frame;
    frame.eye_x_m = 17.25;
    frame.across_x = 0.0331;
    frame.across_y = 0.0007;
    frame.down_x = 0.0011;
    frame.down_y = -0.0334;
    const double du = 2.0 / 1024;
    place_run(block, -1, du, 0.3, 0, n, z.data(), frame, across.data(), down.data());
    raise_run(block, -1, du, 0.3, 0, n, z.data(), 1.7, raised.data());
    keep(across);
    keep(down);
    keep(raised);
    std::vector<float> t(n), s(n), rise(n), steep(n);
    const std::vector<double> forwards = drawn(n, 0.7, 900), sideways = drawn(n, -500, 500);
    keep(take_picture(n, forwards.data(), sideways.data(), z.data(), is_void.data(), 312.5, -0.125,
                      77.3, 0.75, t.data(), s.data()));
    keep(t);
    keep(s);
    take_level_picture(n, 333.3, sideways.data(), z.data(), is_void.data(), 312.5, -0.125, 77.3,
                       t.data(), s.data());
    keep(t);
    keep(s);
    keep(take_rises(n, t.data(), s.data(), is_void.data(), 0.5F, rise.data(), steep.data()));
    keep(rise);
    keep(steep);
  }

  void bounds(std::size_t bins) {
    const std::size_t n = bins + 9;
    // Samples a little closer than bins, beginning and ending outside.
    std::vector<float> t(n);
    for (std::size_t i = 0; i < n; ++i)
      t[i] = static_cast<float>(-2.5 +
                                static_cast<double>(i) * (static_cast<double>(bins) + 5) /
                                    static_cast<double>(n - 1) +
                                0.1 * unit());
    const std::vector<float> s = drawn_floats(n, -0.2, 0.3), steep = drawn_floats(n, 0, 0.1);
    std::vector<float> place(bins + 1), shifted(bins + 1), even(bins + 1);
    keep(near_even_places(0, bins + 1, n, t.data(), place.data()));
    keep(place);
    even_places(bins + 1, 0.97F, 2.3F, even.data());
    shift_places(bins + 1, place.data(), 0.25F, shifted.data());
    keep(even);
    keep(shifted);
    std::vector<std::int32_t> before(bins + 1);
    std::vector<float> here(bins + 1), next(bins + 1), edge_low(bins + 1), edge_high(bins + 1);
    edge_bounds(bins + 1, place.data(), s.data(), steep.data(), 1e-3F, 0x1p-20F, before.data(),
                here.data(), next.data(), edge_low.data(), edge_high.data());
    keep(before);
    keep(here);
    keep(next);
    keep(edge_low);
    keep(edge_high);
    std::vector<float> pairs(n), up(bins), low = drawn_floats(bins, -0.2, 0.1),
                                           high = drawn_floats(bins, 0, 0.3);
    take_pairs(n, s.data(), pairs.data());
    keep(pairs);
    keep(bin_bounds(bins, place.data(), shifted.data(), 1e-4F, s.data(), pairs.data(),
                    before.data(), here.data(), next.data(), edge_low.data(), edge_high.data(),
                    up.data(), low.data(), high.data()));
    keep(up);
    keep(low);
    keep(high);
    std::vector<std::int32_t> top(bins, -1);
    take_top(bins, up.data(), high.data(), 12, top.data());
    keep(top);
    take_maximum(bins, up.data(), low.data());
    keep(low);
    std::vector<std::uint8_t> decisions(n);
    classify(n, t.data(), s.data(), static_cast<std::int32_t>(bins), low.data(), high.data(),
             0x1p-20F, reinterpret_cast<Decision*>(decisions.data()));
    keep(decisions);
  }

  std::mt19937 random_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace
}  // namespace scarp
