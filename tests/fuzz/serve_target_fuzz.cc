#include <stdexcept>
#include <string>

#include "cli/serve/request_target.h"
#include "tests/fuzz/fuzz_target.h"

/// The address of a request: any bytes are understood or refused, and what is understood names no
/// way out of a folder.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scarp;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto target = parse_target(text);
  if (!target) return 0;
  std::string again;
  for (const std::string& segment : target->segments) {
    if (segment == "." || segment == ".." || segment.find_first_of("/\\") != std::string::npos ||
        segment.find('\0') != std::string::npos || !is_utf8(segment))
      throw std::logic_error("a segment leads elsewhere: " + segment);
    again += "/" + encode_segment(segment);
  }
  if (again.empty()) again = "/";
  const auto same = parse_target(again);
  if (!same || same->segments != target->segments)
    throw std::logic_error("what was read is not what is read again: " + again);
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  std::vector<std::vector<std::uint8_t>> seeds;
  for (const std::string text :
       {"/", "/scenes/alps/tiles/hillshade/10/536/361.png?v=0a1b",
        "/scenes/%c3%a9/height?at=8.6%2C46.5", "/a//b/", "/scenes/alps/files/../../x",
        "/%2e%2e/%252e%252e/%00", "/x?a=1&b=%26&c&&d=+e",
        "/a/b/c/d/e/f/g/h/i/j/k/l/m/n/o/p/q/r/s/t/u/v/w/x/y/z/0/1/2/3/4/5/6/7/8/9"})
    seeds.emplace_back(text.begin(), text.end());
  return seeds;
}
