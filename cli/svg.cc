#include "cli/svg.h"

#include <fmt/format.h>

#include <cmath>

namespace scarp {
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

std::string svg_begin(double width_px, double height_px) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"14\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width_px, height_px);
}

std::string svg_text(double x_px, double y_px, const char* anchor, const char* colour, int size_px,
                     const std::string& words) {
  return fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\" font-size=\"{}\" "
      "stroke=\"#ffffff\" "
      "stroke-width=\"3\" paint-order=\"stroke\">{}</text>\n",
      x_px, y_px, anchor, colour, size_px, escaped(words));
}

double round_step(double range, double parts) {
  const double rough = range / parts, power = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (rough <= factor * power) return factor * power;
  return 10 * power;
}

}  // namespace scarp
