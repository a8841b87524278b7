#include "tiles/layers/block_raster.h"

#include <cpl_string.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <map>

#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "tiles/layers/describe_dataset.h"
#include "tiles/layers/gdal_session.h"

namespace scarp {
namespace {

/// Tags and types of TIFF 6.0, and of BigTIFF.
enum Tag : std::uint16_t {
  kNewSubfileType = 254,
  kImageWidth = 256,
  kImageLength = 257,
  kBitsPerSample = 258,
  kCompression = 259,
  kPhotometric = 262,
  kSamplesPerPixel = 277,
  kPlanarConfiguration = 284,
  kTileWidth = 322,
  kTileLength = 323,
  kTileOffsets = 324,
  kTileByteCounts = 325,
  kExtraSamples = 338,
  kSampleFormat = 339,
};
enum Type : std::uint16_t { kShort = 3, kLong = 4, kLong8 = 16 };
/// What GDAL says about place, CRS and meaning: ModelPixelScale, ModelTiepoint,
/// ModelTransformation, GeoKeyDirectory, GeoDoubleParams, GeoAsciiParams, GDAL's metadata and
/// nodata.
constexpr std::array<std::uint16_t, 8> kDescribing = {33550, 33922, 34264, 34735,
                                                      34736, 34737, 42112, 42113};
constexpr std::uint16_t kNodata = 42113;

std::size_t type_bytes(std::uint16_t type) {
  constexpr std::array<std::size_t, 19> kBytes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                  8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < kBytes.size() ? kBytes[type] : 0;
}

struct Entry {
  std::uint16_t type = 0;
  std::uint64_t count = 0;
  std::vector<std::byte> values;
};
using Directory = std::map<std::uint16_t, Entry>;  // in the order that TIFF asks for

template <typename Value>
Value value_at(std::span<const std::byte> bytes, std::size_t at) {
  Value value{};
  assert(at + sizeof(Value) <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(Value));
  return value;
}

void put_bytes(std::vector<std::byte>& to, const void* from, std::size_t count) {
  const std::size_t at = to.size();
  to.resize(at + count);
  std::memcpy(&to[at], from, count);
}
template <typename Value>
void put(std::vector<std::byte>& to, Value value) {
  put_bytes(to, &value, sizeof(Value));
}

template <typename Value>
Entry entry(Type type, const std::vector<Value>& values) {
  Entry made{type, values.size(), {}};
  for (const Value value : values) put(made.values, value);
  return made;
}
Entry shorts(std::size_t count, std::uint16_t value) {
  return entry(kShort, std::vector<std::uint16_t>(count, value));
}
Entry longs(std::uint32_t value) {
  return entry(kLong, std::vector<std::uint32_t>{value});
}

/// The first directory of a BigTIFF in memory, as far as it describes.
Directory describing_tags(std::span<const std::byte> file) {
  Directory tags;
  auto at = static_cast<std::size_t>(value_at<std::uint64_t>(file, 8));
  const auto count = value_at<std::uint64_t>(file, at);
  at += 8;
  constexpr std::size_t kEntryBytes = 20;
  for (std::uint64_t i = 0; i < count; ++i, at += kEntryBytes) {
    const auto tag = value_at<std::uint16_t>(file, at);
    if (std::find(kDescribing.begin(), kDescribing.end(), tag) == kDescribing.end()) continue;
    Entry found{value_at<std::uint16_t>(file, at + 2), value_at<std::uint64_t>(file, at + 4), {}};
    const std::size_t bytes = static_cast<std::size_t>(found.count) * type_bytes(found.type);
    const std::size_t from =
        bytes <= 8 ? at + 12 : static_cast<std::size_t>(value_at<std::uint64_t>(file, at + 12));
    found.values.assign(file.begin() + static_cast<std::ptrdiff_t>(from),
                        file.begin() + static_cast<std::ptrdiff_t>(from + bytes));
    tags[tag] = std::move(found);
  }
  return tags;
}

/// What GDAL writes about a layer, read from a small file of its making.
Directory description_of(const RasterLayer& layer, std::size_t bands, GDALDataType type,
                         const std::string& path) {
  const GdalSession session;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  if (driver == nullptr) session.fail(path);
  CPLStringList options;
  options.SetNameValue("BIGTIFF", "YES");
  options.SetNameValue("INTERLEAVE", "BAND");
  options.SetNameValue("SPARSE_OK", "TRUE");
  options.SetNameValue("ENDIANNESS", "LITTLE");
  const std::string small = session.folder() + "/description.tif";
  GDALDatasetUniquePtr dataset(
      driver->Create(small.c_str(), 1, 1, static_cast<int>(bands), type, options.List()));
  if (!dataset) session.fail(path);
  describe(*dataset, layer, path);
  dataset.reset();  // closing writes it
  session.check(path);
  return describing_tags(session.bytes_of(small, path));
}

/// One resolution.
struct Level {
  std::int32_t columns = 0, rows = 0;
  std::uint64_t offset = 0;  ///< of its first square in the file

  std::int32_t across() const { return (columns + BlockRaster::kSide - 1) / BlockRaster::kSide; }
  std::int32_t down() const { return (rows + BlockRaster::kSide - 1) / BlockRaster::kSide; }
  std::uint64_t squares() const {
    return static_cast<std::uint64_t>(across()) * static_cast<std::uint64_t>(down());
  }
};

}  // namespace

struct BlockRaster::State {
  State(const std::string& path, Existing existing) : file(path, existing) {}

  PartFile file;
  std::size_t bands = 0, sample_bytes = 0;
  std::vector<Level> levels;  ///< the whole one, and halves of it
  std::vector<std::byte> nodata;
  /// Of each band in work: its first overview, row by row.
  std::vector<std::vector<std::byte>> halves;

  std::uint64_t square_bytes() const { return std::uint64_t{kSide} * kSide * sample_bytes; }
  std::uint64_t offset_of(const Level& level, std::size_t band, std::int32_t column,
                          std::int32_t row) const {
    const auto square =
        static_cast<std::uint64_t>(row / kSide) * static_cast<std::uint64_t>(level.across()) +
        static_cast<std::uint64_t>(column / kSide);
    return level.offset + (band * level.squares() + square) * square_bytes();
  }
  std::size_t half_columns() const { return static_cast<std::size_t>((levels[0].columns + 1) / 2); }

  /// A square of an overview, from the first one.
  template <typename Sample>
  void write_overview(std::size_t band, std::size_t level, std::int32_t column, std::int32_t row) {
    const Level& to_level = levels[level];
    const std::size_t step = std::size_t{1} << (level - 1);
    Sample nothing;
    std::memcpy(&nothing, nodata.data(), sizeof(Sample));
    std::vector<Sample> square(std::size_t{kSide} * kSide, nothing);
    const std::int32_t columns = std::min(kSide, to_level.columns - column);
    const auto* half = reinterpret_cast<const Sample*>(halves[band].data());
    for (std::int32_t r = 0; r < std::min(kSide, to_level.rows - row); ++r) {
      const Sample* from = half + static_cast<std::size_t>(row + r) * step * half_columns() +
                           static_cast<std::size_t>(column) * step;
      Sample* to = square.data() + r * kSide;
      if (step == 1)
        std::copy_n(from, columns, to);
      else
        for (std::int32_t c = 0; c < columns; ++c) to[c] = from[static_cast<std::size_t>(c) * step];
    }
    file.write_at(offset_of(to_level, band, column, row), std::as_bytes(std::span(square)));
  }

  Directory directory_of(const Level& level, bool is_overview, std::uint16_t format,
                         const Directory& description) const {
    Directory tags;
    tags[kNewSubfileType] = longs(is_overview ? 1 : 0);
    tags[kImageWidth] = longs(static_cast<std::uint32_t>(level.columns));
    tags[kImageLength] = longs(static_cast<std::uint32_t>(level.rows));
    tags[kBitsPerSample] = shorts(bands, static_cast<std::uint16_t>(8 * sample_bytes));
    tags[kCompression] = shorts(1, 1);
    tags[kPhotometric] = shorts(1, 1);
    tags[kSamplesPerPixel] = shorts(1, static_cast<std::uint16_t>(bands));
    tags[kPlanarConfiguration] = shorts(1, bands > 1 ? 2 : 1);
    tags[kTileWidth] = longs(kSide);
    tags[kTileLength] = longs(kSide);
    const auto squares = static_cast<std::size_t>(level.squares()) * bands;
    std::vector<std::uint64_t> offsets(squares);
    for (std::size_t i = 0; i < squares; ++i) offsets[i] = level.offset + i * square_bytes();
    tags[kTileOffsets] = entry(kLong8, offsets);
    tags[kTileByteCounts] = entry(
        kLong, std::vector<std::uint32_t>(squares, static_cast<std::uint32_t>(square_bytes())));
    if (bands > 1) tags[kExtraSamples] = shorts(bands - 1, 0);
    tags[kSampleFormat] = shorts(bands, format);
    for (const auto& [tag, value] : description)
      if (!is_overview || tag == kNodata) tags[tag] = value;
    return tags;
  }

  /// All directories before all samples, the smallest overview's first. Run twice: the first time
  /// to learn how long they are.
  std::vector<std::byte> lay_out(std::uint16_t format, const Directory& description) {
    std::vector<std::byte> head;
    put(head, std::uint16_t{0x4949});
    put(head, std::uint16_t{43});
    put(head, std::uint16_t{8});
    put(head, std::uint16_t{0});
    put(head, std::uint64_t{16});  // where the first directory begins: here
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const Directory tags = directory_of(levels[i], i > 0, format, description);
      std::uint64_t values_at = head.size() + 8 + 20 * tags.size() + 8;
      std::vector<std::byte> values;
      put(head, static_cast<std::uint64_t>(tags.size()));
      for (const auto& [tag, found] : tags) {
        put(head, tag);
        put(head, found.type);
        put(head, found.count);
        if (found.values.size() <= 8) {
          std::vector<std::byte> inside = found.values;
          inside.resize(8);
          put_bytes(head, inside.data(), inside.size());
          continue;
        }
        put(head, values_at + values.size());
        put_bytes(values, found.values.data(), found.values.size());
        values.resize((values.size() + 7) / 8 * 8);
      }
      const bool is_last = i + 1 == levels.size();
      put(head, is_last ? std::uint64_t{0} : values_at + values.size());
      put_bytes(head, values.data(), values.size());
    }
    constexpr std::size_t kPage = 4096;
    head.resize((head.size() + kPage - 1) / kPage * kPage);
    std::uint64_t offset = head.size();
    for (std::size_t i = levels.size(); i-- > 0;) {
      levels[i].offset = offset;
      offset += levels[i].squares() * bands * square_bytes();
    }
    return head;
  }
};

BlockRaster::BlockRaster(const std::string& path, const RasterLayer& layer, Existing existing)
    : state_(std::make_unique<State>(path, existing)) {
  State& state = *state_;
  const bool is_float = std::holds_alternative<std::span<const float>>(layer.samples);
  assert(is_float || std::holds_alternative<std::span<const std::int16_t>>(layer.samples));
  state.bands = layer.more_bands.size() + 1;
  state.sample_bytes = is_float ? sizeof(float) : sizeof(std::int16_t);
  state.halves.resize(state.bands);
  if (layer.nodata && is_float) put(state.nodata, static_cast<float>(*layer.nodata));
  if (layer.nodata && !is_float) put(state.nodata, static_cast<std::int16_t>(*layer.nodata));
  state.nodata.resize(state.sample_bytes);
  Level level{layer.columns, layer.rows, 0};
  for (;;) {
    state.levels.push_back(level);
    if (std::max(level.columns, level.rows) <= kSide) break;
    level.columns = (level.columns + 1) / 2;
    level.rows = (level.rows + 1) / 2;
  }
  const Directory description =
      description_of(layer, state.bands, is_float ? GDT_Float32 : GDT_Int16, path);
  const std::uint16_t format = is_float ? 3 : 2;
  state.lay_out(format, description);
  const std::vector<std::byte> head = state.lay_out(format, description);
  state.file.reserve(state.levels[0].offset +
                     state.levels[0].squares() * state.bands * state.square_bytes());
  state.file.write_at(0, head);
}

BlockRaster::~BlockRaster() = default;

std::size_t BlockRaster::bands() const {
  return state_->bands;
}

void BlockRaster::begin(std::size_t band) {
  const std::size_t rows = static_cast<std::size_t>((state_->levels[0].rows + 1) / 2);
  state_->halves[band].resize(rows * state_->half_columns() * state_->sample_bytes);
}

void BlockRaster::write(std::size_t band, std::int32_t first_column, std::int32_t first_row,
                        std::int32_t columns, std::int32_t rows,
                        std::span<const std::byte> samples) {
  State& state = *state_;
  const std::size_t bytes = state.sample_bytes,
                    row_bytes = static_cast<std::size_t>(columns) * bytes;
  assert(first_column % kSide == 0 && first_row % kSide == 0 && columns <= kSide && rows <= kSide);
  assert(samples.size() == row_bytes * static_cast<std::size_t>(rows));
  std::vector<std::byte> whole;
  std::span<const std::byte> square = samples;
  if (columns < kSide || rows < kSide) {
    whole.resize(static_cast<std::size_t>(state.square_bytes()));
    for (std::size_t i = 0; i < whole.size(); i += bytes)
      std::copy(state.nodata.begin(), state.nodata.end(), &whole[i]);
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r)
      std::copy_n(&samples[r * row_bytes], row_bytes, &whole[r * kSide * bytes]);
    square = whole;
  }
  state.file.write_at(state.offset_of(state.levels[0], band, first_column, first_row), square);
  const auto halve = [&]<typename Sample>(Sample) {
    const auto* from = reinterpret_cast<const Sample*>(samples.data());
    auto* half = reinterpret_cast<Sample*>(state.halves[band].data());
    for (std::int32_t r = 0; r < rows; r += 2) {
      Sample* to = half + static_cast<std::size_t>((first_row + r) / 2) * state.half_columns() +
                   first_column / 2;
      const Sample* row = from + std::ptrdiff_t{r} * columns;
      for (std::ptrdiff_t c = 0; c < (columns + 1) / 2; ++c) to[c] = row[2 * c];
    }
  };
  if (bytes == sizeof(std::int16_t))
    halve(std::int16_t{});
  else
    halve(std::uint32_t{});
}

void BlockRaster::finish(std::size_t first_band, std::size_t count) {
  State& state = *state_;
  const Level& whole = state.levels[0];
  for (std::size_t band = first_band; band < first_band + count; ++band)
    state.file.begin_flush(state.offset_of(whole, band, 0, 0),
                           whole.squares() * state.square_bytes());
  // All squares of all overviews of all bands in one row.
  struct Square {
    std::size_t band, level;
    std::int32_t column, row;
  };
  std::vector<Square> squares;
  for (std::size_t band = first_band; band < first_band + count; ++band)
    for (std::size_t l = 1; l < state.levels.size(); ++l)
      for (std::int32_t row = 0; row < state.levels[l].rows; row += kSide)
        for (std::int32_t column = 0; column < state.levels[l].columns; column += kSide)
          squares.push_back({band, l, column, row});
  parallel_for(squares.size(), [&](std::size_t i) {
    const Square& square = squares[i];
    if (state.sample_bytes == sizeof(std::int16_t))
      state.write_overview<std::int16_t>(square.band, square.level, square.column, square.row);
    else
      state.write_overview<std::uint32_t>(square.band, square.level, square.column, square.row);
  });
  for (std::size_t band = first_band; band < first_band + count; ++band)
    std::vector<std::byte>().swap(state.halves[band]);  // {} would keep the memory
}

void BlockRaster::commit() {
  state_->file.commit();
}

}  // namespace scarp
