#include "cli/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace scarp {
namespace {

constexpr int kBarWidth = 30;
constexpr auto kRedrawEvery = std::chrono::milliseconds(80);

}  // namespace

ProgressBar::ProgressBar(bool enabled) : enabled_(enabled && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  clear();
}

Progress ProgressBar::stage(const std::string& name) {
  name_ = name;
  begun_ = std::chrono::steady_clock::now();
  last_ = {};
  draw(0);
  return [this](double done) { draw(done); };
}

void ProgressBar::clear() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");
  drawn_ = false;
}

void ProgressBar::draw(double done) {
  const auto now = std::chrono::steady_clock::now();
  if (!enabled_ || now - last_ < kRedrawEvery) return;
  last_ = now;
  const int full = static_cast<int>(std::clamp(done, 0.0, 1.0) * kBarWidth);
  const double spent_s = std::chrono::duration<double>(now - begun_).count();
  const std::string left =
      done > 0.02 && spent_s > 1 ? fmt::format("{:.0f} s left", spent_s * (1 - done) / done) : "";
  fmt::print(stderr, "\r{:<10} [{:<{}}] {:3.0f} % {}\x1b[K", name_,
             std::string(static_cast<std::size_t>(full), '#'), kBarWidth, 100 * done, left);
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace scarp
