#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "cli/serve/negotiation.h"
#include "tests/fuzz/fuzz_target.h"

/// Accept, Prefer, Range and If-None-Match: any bytes have an answer within its bounds.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scarp;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  static const std::array<std::string, 3> kOffers = {"application/json", "image/png",
                                                     "image/tiff; application=geotiff"};
  const auto chosen = choose_media_type(text, kOffers);
  if (chosen && *chosen >= kOffers.size()) throw std::logic_error("chose what is not offered");
  const Preference preference = parse_prefer(text);
  if (preference.wait_s && !(*preference.wait_s >= 0 && std::isfinite(*preference.wait_s)))
    throw std::logic_error("waits for ever");
  for (const std::uint64_t bytes : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1000}}) {
    ByteRange part;
    if (parse_range_header(text, bytes, part) == RangeAnswer::kPart &&
        (part.bytes == 0 || part.first >= bytes || part.bytes > bytes - part.first))
      throw std::logic_error("a part beyond the whole");
  }
  matches_etag(text, "\"0a1b\"");
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  std::vector<std::vector<std::uint8_t>> seeds;
  for (const std::string text :
       {"text/html, image/*;q=0.8, */*;q=0.1", "image/png; x=\"a,b;q=1\\\"\"; q=0.5",
        "respond-async, wait=10; foo=\"x,y\"", "return=minimal", "bytes=0-99", "bytes=-5",
        "bytes=999-", "bytes=18446744073709551615-18446744073709551615", "W/\"0a1b\", \"x\", *"})
    seeds.emplace_back(text.begin(), text.end());
  return seeds;
}
