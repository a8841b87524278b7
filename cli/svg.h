#pragma once

#include <string>

/// Pieces of the SVG pictures that commands draw. Coordinates are pixels, y downwards.
namespace scarp {

inline constexpr char kInkColour[] = "#2b2f36", kFaintColour[] = "#dfe3e8",
                      kSoftColour[] = "#69707a";

/// Text as XML and HTML have it, in quotes too.
std::string escaped(const std::string& text);

/// The head of a picture and its white ground; "</svg>\n" ends it.
std::string svg_begin(double width_px, double height_px);

/// Words with a white edge, so that they can be read over lines. Anchor: start, middle or end.
std::string svg_text(double x_px, double y_px, const char* anchor, const char* colour, int size_px,
                     const std::string& words);

/// A round step, 1, 2 or 5 times a power of ten, that divides a range into about `parts`.
double round_step(double range, double parts);

}  // namespace scarp
