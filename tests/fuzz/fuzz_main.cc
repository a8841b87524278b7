#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>

#include "tests/fuzz/fuzz_target.h"

/// Drives a fuzz target with its seeds and with deterministic corruptions of them, each in a copy
/// of exactly its size, so that the address sanitizer sees the first byte read beyond it.
///   --runs N   how many inputs (1000)
///   --seed S   another S, other corruptions (1)
///   --only K   input K alone, to look at a failure
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Options {
  std::uint64_t runs = 1000;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> only;
};

char crash_note[128];

/// The target crashed: say which input it was, then die of the same signal.
void report_crash(int signal_number) {
  [[maybe_unused]] const ssize_t written =
      ::write(STDERR_FILENO, crash_note, std::strlen(crash_note));
  ::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

std::optional<std::uint64_t> number_from(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

std::optional<Options> options_from(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; i += 2) {
    const std::string_view name = arguments[i];
    const auto value = i + 1 < count ? number_from(arguments[i + 1]) : std::nullopt;
    if (!value) return {};
    if (name == "--runs")
      options.runs = *value;
    else if (name == "--seed")
      options.seed = *value;
    else if (name == "--only")
      options.only = *value;
    else
      return {};
  }
  return options;
}

/// Numbers that sit at the ends of what counts, sizes and offsets can say.
constexpr std::uint64_t kTellingNumbers[] = {0,
                                             1,
                                             2,
                                             63,
                                             64,
                                             65,
                                             0x7f,
                                             0x80,
                                             0xff,
                                             0x7fff,
                                             0xffff,
                                             0x7fffffff,
                                             0x80000000,
                                             0xfffffffe,
                                             0xffffffff,
                                             0x7fffffffffffffff,
                                             0xffffffffffffffc0,
                                             0xffffffffffffffff};

class Corruptor {
 public:
  explicit Corruptor(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t limit) { return static_cast<std::size_t>(random_() % limit); }

  void corrupt(Bytes& bytes) {
    if (bytes.empty()) return bytes.push_back(static_cast<std::uint8_t>(below(256)));
    const std::size_t at = below(bytes.size());
    switch (below(7)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes[at] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 2:
        bytes[at] = static_cast<std::uint8_t>(below(256));
        break;
      case 3:
        put_number(bytes, at);
        break;
      case 4:
        copy_piece(bytes, at);
        break;
      case 5:
        remove_piece(bytes, at);
        break;
      default:
        insert_piece(bytes, at);
        break;
    }
  }

 private:
  static std::ptrdiff_t step(std::size_t n) { return static_cast<std::ptrdiff_t>(n); }

  std::size_t piece_size(const Bytes& bytes, std::size_t at) {
    return 1 + below(std::min<std::size_t>(bytes.size() - at, 80));
  }

  void put_number(Bytes& bytes, std::size_t at) {
    const std::uint64_t number = kTellingNumbers[below(std::size(kTellingNumbers))];
    const std::size_t width = std::size_t{1} << below(4);
    at -= at % width;  // where numbers lie
    std::memcpy(bytes.data() + at, &number, std::min(width, bytes.size() - at));
  }

  void copy_piece(Bytes& bytes, std::size_t at) {
    const std::size_t size = piece_size(bytes, at);
    const Bytes piece(bytes.begin() + step(at), bytes.begin() + step(at + size));
    const std::size_t to = below(bytes.size() - size + 1);
    std::copy(piece.begin(), piece.end(), bytes.begin() + step(to));
  }

  void remove_piece(Bytes& bytes, std::size_t at) {
    const std::size_t size = piece_size(bytes, at);
    bytes.erase(bytes.begin() + step(at), bytes.begin() + step(at + size));
  }

  void insert_piece(Bytes& bytes, std::size_t at) {
    const std::size_t size = piece_size(bytes, at);
    const Bytes piece(bytes.begin() + step(at), bytes.begin() + step(at + size));
    bytes.insert(bytes.begin() + step(below(bytes.size())), piece.begin(), piece.end());
  }

  std::mt19937_64 random_;
};

/// Input `run`: the seeds as they are, then damaged ones. Depends on nothing but run and seed.
Bytes input_of(std::uint64_t run, std::uint64_t seed, const std::vector<Bytes>& seeds) {
  if (run < seeds.size()) return seeds[static_cast<std::size_t>(run)];
  Corruptor corruptor(seed * 0x9e3779b97f4a7c15U + run);
  Bytes bytes = seeds[corruptor.below(seeds.size())];
  const std::size_t corruptions = 1 + corruptor.below(4);
  for (std::size_t i = 0; i < corruptions; ++i) corruptor.corrupt(bytes);
  return bytes;
}

bool passes(const Bytes& input, std::uint64_t run) {
  const auto exact = std::make_unique<std::uint8_t[]>(input.size());
  std::copy(input.begin(), input.end(), exact.get());
  try {
    LLVMFuzzerTestOneInput(exact.get(), input.size());
    return true;
  } catch (const std::exception& error) {
    fmt::print(stderr, "input {}: {}\n", run, error.what());
    return false;
  }
}

}  // namespace

int main(int count, char** arguments) {
  const std::optional<Options> options = options_from(count, arguments);
  if (!options) {
    fmt::print(stderr, "usage: {} [--runs N] [--seed S] [--only K]\n", arguments[0]);
    return 2;
  }
  for (const int signal_number : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT})
    ::signal(signal_number, report_crash);
  const std::vector<Bytes> seeds = fuzz_seeds();
  const std::uint64_t first = options->only.value_or(0);
  const std::uint64_t end = options->only ? first + 1 : options->runs;
  std::uint64_t passed = 0, failed = 0;
  for (std::uint64_t run = first; run < end; ++run) {
    *fmt::format_to_n(crash_note, sizeof crash_note - 1, "crashed: --seed {} --only {}\n",
                      options->seed, run)
         .out = '\0';
    ++(passes(input_of(run, options->seed, seeds), run) ? passed : failed);
  }
  fmt::print("{} passed, {} failed\n", passed, failed);
  return failed == 0 ? 0 : 1;
}
