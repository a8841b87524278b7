#pragma once

/// Scarp at run time: which groups of a terrain a camera cannot see, from one file.
///
/// One header of C++17, with nothing else: no exceptions, no RTTI, no allocation (not even when a
/// file is opened), no library but the standard one. docs/runtime.md has the file's bytes and the
/// same answers from JavaScript (scarp.mjs).
///
///   scarp::runtime::Culling culling;
///   if (culling.open(bytes, size) != scarp::runtime::Status::kOk) ...
///   const auto camera = culling.camera(x, y, z);               // ECEF, metres (EPSG:4978)
///   const auto frustum = culling.frustum(camera, planes, 6);   // may be left out
///   const std::uint32_t n = culling.visible(camera, &frustum, groups);
///
/// Side of error: what is not among the visible groups is hidden, all of it, for certain, as far as
/// the scene's mesh is right. What is called visible may be hidden.
///
/// Same bits. A camera is rounded once, to multiples of 2^-unit_bits m. From there on every number
/// is an integer below 2^53 in a double (quotients and roots are rounded down to one at once), so
/// that no instruction set, contraction or order of work can change an answer, and JavaScript gives
/// the same. Reassociating floating point (-ffast-math) is refused.
///
/// Why a rounded camera is safe. The regions hold for cells of directions and distances widened by
/// 2^-14 on all sides (radians, and relative to the distance).
///  * Place. Camera and centre of the group are rounded by half a unit in x and y each, and
///    distances are cut down to multiples of 2^shift units: together less than 2 * sqrt(2) of
///    those. A group nearer than 2^17 of them is visible, so that this turns the direction and
///    changes the distance by less than 2^-15.5.
///  * Sector. The tangent is cut to 2^-17, its polynomial has constants of 17 bits (2^-20) and is
///    cut to 2^-17 of an eighth; a radian is at least 1.24 eighths' units: less than 2^-16 rad.
///    2^-15.5 + 2^-16 < 2^-14.
///  * Ring. Root, reciprocal radius and ratio are cut to 2^-17, 2^-24 and 2^-16:
///    2^-15.5 + 2^-17 + 2^-24 + 2^-16 < 2^-14.
///  * Height. The camera is taken higher than it is, slopes and the group's height as lower than
///    they are, and the distance as the end of its interval at which the line is lower. Rising is
///    never better for being hidden. So what is hidden here is hidden from where the camera is.
///
/// Thread safety: all const members may be called from any number of threads.

#if defined(__FAST_MATH__) || defined(_M_FP_FAST)
#error "scarp_runtime.h needs IEEE arithmetic: compile without -ffast-math or /fp:fast"
#endif

#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if FLT_EVAL_METHOD != 0
#error "scarp_runtime.h needs doubles that are doubles: compile for SSE2 (-msse2 -mfpmath=sse)"
#endif

#if defined(__SSE2__)
#include <emmintrin.h>
#endif
#if defined(__x86_64__) && defined(__GNUC__) && !defined(SCARP_RUNTIME_NO_AVX2)
#define SCARP_RUNTIME_AVX2 1  // found out at run time
#include <immintrin.h>
#endif

#if !defined(SCARP_RUNTIME_NO_FILES) && (defined(__unix__) || defined(__APPLE__))
#define SCARP_RUNTIME_FILES 1
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace scarp {
namespace runtime {

enum class Status {
  kOk,
  kUnreadable,  ///< the file is not there, or cannot be read
  kMisaligned,  ///< the bytes do not start at a multiple of 8
  kBigEndian,   ///< this machine is, the file is not
  kNotOurs,     ///< another kind of file
  kVersion,     ///< of a later version
  kDamaged,     ///< sizes, checksums or numbers are wrong
};

/// How much of a file is read when it is opened.
enum class Check {
  kEverything,  ///< all checksums: one pass over the file
  kStructure,   ///< header and tiles only; damage elsewhere makes wrong answers, never a crash
};

/// A place to look from, rounded. Made by Culling::camera.
struct Camera {
  std::int32_t x = 0, y = 0;                              ///< units, nearest
  std::int32_t z = 0;                                     ///< units, above the true height
  std::int32_t z_straight = 0;                            ///< units, nearest, without refraction
  double exact_x = 0, exact_y = 0, exact_z_straight = 0;  ///< units, for frustums
  bool is_valid = false;                                  ///< false: out of reach, sees everything
};

/// Half-spaces that a view lies in, for one camera. Made by Culling::frustum.
struct Frustum {
  static constexpr int kMaxPlanes = 8;
  struct Plane {
    double a, b, c, at_camera;  ///< whole numbers; a, b, c at most 2^17, at_camera at most 2^50
  };
  Plane planes[kMaxPlanes];
  int count = 0;
};

/// A group as the file has it, for tools.
struct GroupRecord {
  std::int32_t x, y, height;   ///< centre of its circle, and where slopes start from; units
  float inverse_radius;        ///< 2^16 / the radius where regions begin, 1 / units
  std::int32_t low_slope;      ///< of code 1, 2^-20
  std::uint32_t slope_step;    ///< from code to code, 2^-30
  const std::int32_t* box;     ///< [6] low x, y, z, high x, y, z without refraction, units
  const std::uint16_t* steps;  ///< [sectors * 8]
  std::uint32_t sectors;
};

/// An upright box that holds an object, rounded outwards. Only its top counts.
struct Box {
  std::int32_t low_x = 0, low_y = 0, high_x = 0, high_y = 0, top = 0;  ///< units
  bool is_valid = false;
};

enum class TileAnswer {
  kUnknown,
  kOccluded,     ///< nothing of it can be seen: need not be drawn
  kNotOccluded,  ///< ground of it is seen: the camera is right above
};

/// A tile of the scene: level 0 is the root; groups [first_group, first_group + groups) of the file
/// lie in it.
struct Tile {
  std::uint32_t level, column, row;
  std::uint32_t flags;  ///< kHasOrphans, kIsFinest
  std::uint32_t first_group, groups;
  std::int32_t low[3], high[3];  ///< of its mesh and the centres of its groups, units
  std::int32_t inner[4];  ///< low x, y, high x, y of a rectangle all over its ground; low above
                          ///< high where there is none
};
inline constexpr std::uint32_t kHasOrphans = 1, kIsFinest = 2;
static_assert(sizeof(Tile) == 64, "as in the file");

namespace detail {

constexpr std::uint32_t kHeaderBytes = 256, kVersionOfFile = 2, kSections = 13;
constexpr std::uint32_t kMostGroups = 1U << 28, kMostTiles = 1U << 24, kMostCells = 1U << 30;
constexpr std::uint32_t kBlockGroups = 32;  ///< groups that share a box for frustums
constexpr std::uint32_t kSteps = 8;         ///< of a sector
constexpr std::uint32_t kSlopeBits = 10, kSlopeCodes = 1U << kSlopeBits;
constexpr double kReach = 2147483000.0;    // coordinates in units fit 32 bits
constexpr double kMostParts = 67108864.0;  // 2^26
constexpr double kLeastParts = 131072.0;   // 2^17
constexpr double kRatioOne = 65536.0;      // 2^16
constexpr double kMostRatio = 33554431.0;  // 2^25 - 1
constexpr double kTangentOne = 131072.0;   // 2^17
constexpr double kSectorA = 166855.0;      // 1.273 * 2^17
constexpr double kSectorB = 35783.0;       // kSectorA - 2^17
constexpr double kSlopeOne = 1048576.0;    // 2^20
constexpr std::int16_t kNoHeight = -32768;

/// A double that no compiler contracts with what comes before it.
inline double rounded(double value) {
  volatile double kept = value;
  return kept;
}
inline double times(double a, double b) {
  return rounded(a * b);
}
inline double dot(const double* a, const double* b) {
  return rounded(rounded(times(a[0], b[0]) + times(a[1], b[1])) + times(a[2], b[2]));
}

inline double floor_of(double value) {
  return std::floor(value);
}
/// The same of numbers from 0 to 2^31.
inline double cut(double value) {
  return static_cast<double>(static_cast<std::int32_t>(value));
}
inline double least(double a, double b) {
  return a < b ? a : b;
}
inline double most(double a, double b) {
  return a > b ? a : b;
}
inline double power_of_2(int exponent) {
  return std::ldexp(1.0, exponent);
}

/// CRC-32 (polynomial 0xEDB88320), eight bytes at a time.
struct CrcTables {
  std::uint32_t of[8][256];
  constexpr CrcTables() : of() {
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t crc = i;
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320U : 0U);
      of[0][i] = crc;
    }
    for (std::uint32_t i = 0; i < 256; ++i)
      for (int t = 1; t < 8; ++t) of[t][i] = (of[t - 1][i] >> 8) ^ of[0][of[t - 1][i] & 255];
  }
};
inline constexpr CrcTables kCrc{};

inline std::uint32_t crc_of(const unsigned char* bytes, std::uint64_t size) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (; size >= 8; size -= 8, bytes += 8) {
    std::uint32_t low, high;
    std::memcpy(&low, bytes, 4);
    std::memcpy(&high, bytes + 4, 4);
    low ^= crc;
    crc = kCrc.of[7][low & 255] ^ kCrc.of[6][(low >> 8) & 255] ^ kCrc.of[5][(low >> 16) & 255] ^
          kCrc.of[4][low >> 24] ^ kCrc.of[3][high & 255] ^ kCrc.of[2][(high >> 8) & 255] ^
          kCrc.of[1][(high >> 16) & 255] ^ kCrc.of[0][high >> 24];
  }
  for (; size > 0; --size, ++bytes) crc = (crc >> 8) ^ kCrc.of[0][(crc ^ *bytes) & 255];
  return ~crc;
}

template <class T>
T read(const unsigned char* bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes + at, sizeof value);
  return value;
}

}  // namespace detail

/// An open file. Keeps pointers into the bytes, which must outlive it; a file that it opened itself
/// stays mapped until it is destroyed.
class Culling {
 public:
  Culling() = default;
  ~Culling() { close(); }
  Culling(const Culling&) = delete;
  Culling& operator=(const Culling&) = delete;

  /// Opens bytes in memory, aligned to 8. Cost: a pass over them, or over the tiles alone.
  Status open(const void* data, std::size_t size, Check check = Check::kEverything);

#ifdef SCARP_RUNTIME_FILES
  /// Maps a file into memory and opens it.
  Status open(const char* path, Check check = Check::kEverything);
#endif

  /// Forgets the file.
  void close();

  bool is_open() const {
    return bytes_ != nullptr;
  }
  std::uint32_t groups() const {
    return groups_;
  }
  std::uint32_t tiles() const {
    return tiles_;
  }
  const Tile& tile(std::uint32_t i) const {
    return tile_[i];
  }
  /// The number in the scene of a group of the file, and its triangles.
  std::uint32_t id(std::uint32_t group) const {
    return id_[group];
  }
  std::uint32_t triangles(std::uint32_t group) const {
    return triangles_[group];
  }
  double unit_m() const {
    return 1 / units_per_m_;
  }
  GroupRecord record(std::uint32_t group) const {
    return {x_[group],
            y_[group],
            height_[group],
            inverse_[group],
            low_[group],
            step_[group],
            box_ + std::size_t{group} * 6,
            steps_ + std::size_t{group} * sectors_ * detail::kSteps,
            sectors_};
  }

  /// The camera at a place: ECEF metres; of a flat scene metres of the map.
  Camera camera(double x, double y, double z) const;
  /// The camera at a place of the flattened frame, metres.
  Camera camera_in_frame(double x_m, double y_m, double z_m) const;

  /// What a view shows: half-spaces a x + b y + c z + d >= 0 of the coordinates that camera()
  /// takes.
  /// @param planes  [count * 4] a, b, c, d; at most Frustum::kMaxPlanes count
  /// Side: rounded outwards.
  Frustum frustum(const Camera& camera, const double* planes, int count) const;

  /// Groups that may be seen, by their numbers in the scene, in the order of the file.
  /// @param frustum  null: all around
  /// @param visible  [groups()] room for all
  /// @return how many were written
  /// Cost: some nanoseconds a group.
  std::uint32_t visible(const Camera& camera, const Frustum* frustum, std::uint32_t* visible) const;

  /// Whether one group of the file is hidden. The definition; visible() is the same for many.
  bool hides(const Camera& camera, std::uint32_t group) const;

  /// Whether a tile can be seen. Requires i < tiles().
  TileAnswer tile_answer(const Camera& camera, std::uint32_t i) const;

  /// The least box of the frame that holds an object's corners, [count * 3] in the coordinates that
  /// camera() takes: all of their convex hull.
  Box box(const double* corners, int count) const;
  /// The same from metres of the flattened frame.
  Box box_in_frame(double low_x_m, double low_y_m, double high_x_m, double high_y_m,
                   double top_m) const;

  /// Whether something in a box may be seen: false only where ground hides all of it for certain.
  ///
  /// Every line from the camera to a place of the box passes through the box shrunk towards the
  /// camera by any factor, and there it is no higher than the line to the box's top: where the
  /// ground under all of the shrunk box is higher, nothing of the box is seen. From a cell of
  /// cameras the same holds of the boxes between it and the other.
  /// Cost: a few look-ups for each cell of heights between the two.
  bool box_visible(const Camera& camera, const Box& box) const;
  /// The same from every camera in a cell: in its plan, and not above its top.
  bool box_visible(const Box& cell, const Box& box) const;

 private:
  friend class MovingView;

  /// A camera before the groups of one tile.
  struct Aim {
    double x, y, z;       // units
    double parts, units;  // 2^-shift and 2^shift
  };
  /// What decides about one group.
  struct Look {
    double parts_x, parts_y;  // distances in parts
    double distance;          // parts
    double ratio;
    std::uint32_t sector, ring;
    double turn;  // in eighths * 2^17
    bool is_near;
  };

  Aim aim_at(const Camera& camera, const Tile& tile) const;
  Look look_at(const Aim& aim, std::uint32_t group) const;
  std::uint32_t ring_of(double ratio) const;
  static std::int32_t last_step_of(std::uint32_t ring) {
    return static_cast<std::int32_t>(ring << detail::kSlopeBits | (detail::kSlopeCodes - 1));
  }
  static std::uint32_t code_at(const std::uint16_t* steps, std::int32_t last);
  std::uint32_t code_of(std::uint32_t group, const Look& look) const {
    return code_at(steps_ + (std::size_t{group} * sectors_ + look.sector) * detail::kSteps,
                   last_step_of(look.ring));
  }
  std::int64_t slope_of(std::uint32_t group, std::uint32_t code) const;
  static double safe_distance(double distance, double slope);
  void hidden_block(const Aim& aim, std::uint32_t first, std::uint32_t count,
                    unsigned char* hidden) const;
#if defined(__SSE2__)
  void look_at_two(const Aim& aim, std::uint32_t group, double* distances, double* rises,
                   std::int32_t* sectors, std::int32_t* lasts) const;
#endif
#if defined(SCARP_RUNTIME_AVX2)
  void look_at_four(const Aim& aim, std::uint32_t group, double* distances, double* rises,
                    std::int32_t* sectors, std::int32_t* lasts) const;
  bool has_avx2_ = __builtin_cpu_supports("avx2");
#endif
  static bool is_outside(const Camera& camera, const Frustum& frustum, const std::int32_t* box);
  std::uint32_t show(const Camera& camera, const Frustum* frustum, std::uint32_t first,
                     std::uint32_t count, const unsigned char* hidden,
                     std::uint32_t* visible) const;
  bool is_ground_above(double low_x, double low_y, double high_x, double high_y,
                       double height) const;
  bool place_sections(std::uint64_t size, bool check);
  Status read_header(std::uint64_t size);
  bool are_tiles_sound() const;
  bool to_frame(double x, double y, double z, double* place) const;
  Camera rounded_camera(double x, double y, double z, double z_straight) const;

  const unsigned char* bytes_ = nullptr;
  void* mapped_ = nullptr;
  std::size_t mapped_bytes_ = 0;
  std::uint32_t groups_ = 0, tiles_ = 0, sectors_ = 8, ring_bits_ = 2;
  bool is_flat_ = false;
  double units_per_m_ = 1;
  double origin_[3] = {}, east_[3] = {}, north_[3] = {}, up_[3] = {};
  double scale_m_ = 1, bend_m_ = 0;
  std::int32_t first_column_ = 0, first_row_ = 0;
  std::uint32_t columns_ = 0, rows_ = 0, cell_bits_ = 0;
  std::int32_t base_ = 0, highest_ = 0;
  std::uint32_t height_bits_ = 0;
  const Tile* tile_ = nullptr;
  const std::int32_t *x_ = nullptr, *y_ = nullptr, *height_ = nullptr, *low_ = nullptr;
  const float* inverse_ = nullptr;
  const std::uint32_t *step_ = nullptr, *id_ = nullptr, *triangles_ = nullptr;
  const std::int32_t *box_ = nullptr, *block_ = nullptr;
  const std::uint16_t* steps_ = nullptr;
  const std::int16_t* least_ = nullptr;
};

/// The same answers as Culling::visible for a camera that moves: a group is looked at again only
/// when the camera has gone so far that its answer can have changed.
class MovingView {
 public:
  /// Memory for each group, of the caller: how far the camera may go, and the answer.
  struct Kept {
    double until;
    unsigned char is_hidden;
  };
  /// @param kept   [culling.groups()]
  /// @param units  [culling.tiles()]
  MovingView(const Culling& culling, Kept* kept, double* units)
      : culling_(culling), kept_(kept), units_(units) {
    for (std::uint32_t t = 0; t < culling.tiles(); ++t) units_[t] = 0;
  }

  /// As Culling::visible.
  std::uint32_t visible(const Camera& camera, const Frustum* frustum, std::uint32_t* visible);

  /// How many groups the last call looked at.
  std::uint32_t looked_at() const { return looked_at_; }

 private:
  double look_again(const Culling::Aim& aim, std::uint32_t group, unsigned char* is_hidden) const;

  const Culling& culling_;
  Kept* kept_;
  double* units_;
  Camera last_;
  double travelled_ = 0;
  std::uint32_t looked_at_ = 0;
};

// ---------------------------------------------------------------------------------------------

inline Status Culling::open(const void* data, std::size_t size, Check check) {
  close();
  const std::uint16_t one = 1;
  if (*reinterpret_cast<const unsigned char*>(&one) != 1) return Status::kBigEndian;
  if (reinterpret_cast<std::uintptr_t>(data) % 8 != 0) return Status::kMisaligned;
  bytes_ = static_cast<const unsigned char*>(data);
  Status status = data == nullptr ? Status::kNotOurs : read_header(size);
  if (status == Status::kOk &&
      (!place_sections(size, check == Check::kEverything) || !are_tiles_sound()))
    status = Status::kDamaged;
  if (status != Status::kOk) close();
  return status;
}

#ifdef SCARP_RUNTIME_FILES
inline Status Culling::open(const char* path, Check check) {
  close();
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return Status::kUnreadable;
  struct stat about;
  void* mapped = MAP_FAILED;
  const bool has_size = ::fstat(file, &about) == 0 && about.st_size > 0;
  const std::size_t size = has_size ? static_cast<std::size_t>(about.st_size) : 0;
  if (has_size) mapped = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0);
  ::close(file);
  if (mapped == MAP_FAILED) return has_size ? Status::kUnreadable : Status::kNotOurs;
  const Status status = open(mapped, size, check);
  if (status != Status::kOk) {
    ::munmap(mapped, size);
    return status;
  }
  mapped_ = mapped;
  mapped_bytes_ = size;
  return status;
}
#endif

inline void Culling::close() {
#ifdef SCARP_RUNTIME_FILES
  if (mapped_ != nullptr) ::munmap(mapped_, mapped_bytes_);
#endif
  mapped_ = nullptr;
  bytes_ = nullptr;
  groups_ = tiles_ = columns_ = rows_ = 0;
}

inline Status Culling::read_header(std::uint64_t size) {
  using detail::read;
  if (size < 16 || std::memcmp(bytes_, "SCARPGRP", 8) != 0) return Status::kNotOurs;
  if (read<std::uint32_t>(bytes_, 8) != detail::kVersionOfFile) return Status::kVersion;
  if (size < detail::kHeaderBytes) return Status::kDamaged;
  if (read<std::uint32_t>(bytes_, 252) != detail::crc_of(bytes_, 252)) return Status::kDamaged;
  if (read<std::uint32_t>(bytes_, 12) != detail::kHeaderBytes ||
      read<std::uint64_t>(bytes_, 16) != size || read<std::uint64_t>(bytes_, 244) != 0)
    return Status::kDamaged;
  groups_ = read<std::uint32_t>(bytes_, 24);
  tiles_ = read<std::uint32_t>(bytes_, 28);
  sectors_ = read<std::uint32_t>(bytes_, 32);
  ring_bits_ = read<std::uint32_t>(bytes_, 36);
  const auto unit_bits = read<std::uint32_t>(bytes_, 40);
  const auto earth = read<std::uint32_t>(bytes_, 44);
  double* const vectors[] = {origin_, east_, north_, up_};
  for (std::size_t i = 0; i < 12; ++i) {
    vectors[i / 3][i % 3] = read<double>(bytes_, 48 + 8 * i);
    if (!std::isfinite(vectors[i / 3][i % 3])) return Status::kDamaged;
  }
  scale_m_ = read<double>(bytes_, 144);
  bend_m_ = read<double>(bytes_, 152);
  first_column_ = read<std::int32_t>(bytes_, 160);
  first_row_ = read<std::int32_t>(bytes_, 164);
  columns_ = read<std::uint32_t>(bytes_, 168);
  rows_ = read<std::uint32_t>(bytes_, 172);
  cell_bits_ = read<std::uint32_t>(bytes_, 176);
  base_ = read<std::int32_t>(bytes_, 180);
  height_bits_ = read<std::uint32_t>(bytes_, 184);
  highest_ = read<std::int32_t>(bytes_, 188);
  const bool are_counts_sound = groups_ <= detail::kMostGroups && tiles_ <= detail::kMostTiles &&
                                sectors_ >= 8 && sectors_ <= 4096 && sectors_ % 8 == 0 &&
                                (ring_bits_ == 2 || ring_bits_ == 3) && unit_bits <= 16 &&
                                earth <= 1;
  const bool is_frame_sound =
      scale_m_ > 0 && std::isfinite(scale_m_) && bend_m_ >= 0 && std::isfinite(bend_m_);
  const bool are_heights_sound = columns_ <= 32768 && rows_ <= 32768 && cell_bits_ <= 30 &&
                                 height_bits_ <= 16 && (columns_ == 0) == (rows_ == 0);
  if (!are_counts_sound || !is_frame_sound || !are_heights_sound) return Status::kDamaged;
  is_flat_ = earth == 0;
  units_per_m_ = detail::power_of_2(static_cast<int>(unit_bits));
  return Status::kOk;
}

/// Finds the sections, which follow from the counts alone, and has them fill the file exactly.
inline bool Culling::place_sections(std::uint64_t size, bool check) {
  const std::uint64_t n = groups_;
  std::uint64_t cells = 0;
  for (std::uint64_t columns = columns_, rows = rows_; columns > 0;
       columns = (columns + 1) / 2, rows = (rows + 1) / 2) {
    cells += columns * rows;
    if (columns == 1 && rows == 1) break;
  }
  const std::uint64_t blocks = (n + detail::kBlockGroups - 1) / detail::kBlockGroups;
  const std::uint64_t section_bytes[detail::kSections] = {std::uint64_t{tiles_} * 64,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 4,
                                                          n * 24,
                                                          blocks * 24,
                                                          n * sectors_ * detail::kSteps * 2,
                                                          cells * 2};
  const void* sections[detail::kSections];
  std::uint64_t at = detail::kHeaderBytes;
  for (std::size_t i = 0; i < detail::kSections; ++i) {
    const std::uint64_t begin = (at + 63) / 64 * 64;
    if (begin > size || section_bytes[i] > size - begin) return false;
    for (; at < begin; ++at)
      if (bytes_[at] != 0) return false;
    sections[i] = bytes_ + begin;
    at = begin + section_bytes[i];
    // The first is always looked at: its numbers are indices.
    if ((check || i == 0) && detail::read<std::uint32_t>(bytes_, 192 + 4 * i) !=
                                 detail::crc_of(bytes_ + begin, section_bytes[i]))
      return false;
  }
  if (at != size) return false;
  tile_ = static_cast<const Tile*>(sections[0]);
  x_ = static_cast<const std::int32_t*>(sections[1]);
  y_ = static_cast<const std::int32_t*>(sections[2]);
  height_ = static_cast<const std::int32_t*>(sections[3]);
  inverse_ = static_cast<const float*>(sections[4]);
  low_ = static_cast<const std::int32_t*>(sections[5]);
  step_ = static_cast<const std::uint32_t*>(sections[6]);
  id_ = static_cast<const std::uint32_t*>(sections[7]);
  triangles_ = static_cast<const std::uint32_t*>(sections[8]);
  box_ = static_cast<const std::int32_t*>(sections[9]);
  block_ = static_cast<const std::int32_t*>(sections[10]);
  steps_ = static_cast<const std::uint16_t*>(sections[11]);
  least_ = static_cast<const std::int16_t*>(sections[12]);
  return true;
}

/// Finest tiles share the groups out among them, in the order of the file.
inline bool Culling::are_tiles_sound() const {
  std::uint32_t next = 0;
  for (std::uint32_t i = 0; i < tiles_; ++i) {
    const Tile& tile = tile_[i];
    if (tile.level > 30 || tile.flags > (kHasOrphans | kIsFinest)) return false;
    if (tile.first_group > groups_ || tile.groups > groups_ - tile.first_group) return false;
    for (int axis = 0; axis < 3; ++axis)
      if (tile.low[axis] > tile.high[axis]) return false;
    if ((tile.flags & kIsFinest) == 0) continue;
    if (tile.first_group != next) return false;
    next += tile.groups;
  }
  return next == groups_;
}

/// x, y, z and z without refraction, metres. False where it is out of reach.
inline bool Culling::to_frame(double x, double y, double z, double* place) const {
  using detail::rounded;
  using detail::times;
  const double from[3] = {rounded(x - origin_[0]), rounded(y - origin_[1]),
                          rounded(z - origin_[2])};
  if (is_flat_) {
    place[0] = from[0], place[1] = from[1], place[2] = place[3] = from[2];
    return true;
  }
  const double height = detail::dot(from, up_);
  if (!(height > 0)) return false;
  const double u = rounded(detail::dot(from, east_) / height);
  const double v = rounded(detail::dot(from, north_) / height);
  const double square = rounded(times(u, u) + times(v, v));
  const double root = rounded(std::sqrt(rounded(1 + square)));
  const double bend = rounded(times(bend_m_, square) / rounded(root + 1));
  place[0] = times(scale_m_, u);
  place[1] = times(scale_m_, v);
  place[3] = times(scale_m_, rounded(rounded(height - scale_m_) / height));
  place[2] = rounded(place[3] + bend);
  return true;
}

inline Camera Culling::rounded_camera(double x, double y, double z, double z_straight) const {
  Camera camera;
  camera.exact_x = x * units_per_m_;  // a power of two: exact
  camera.exact_y = y * units_per_m_;
  camera.exact_z_straight = z_straight * units_per_m_;
  const double exact_z = z * units_per_m_;
  if (!(std::fabs(camera.exact_x) < detail::kReach && std::fabs(camera.exact_y) < detail::kReach &&
        std::fabs(exact_z) < detail::kReach && std::fabs(camera.exact_z_straight) < detail::kReach))
    return {};
  camera.x = static_cast<std::int32_t>(detail::floor_of(detail::rounded(camera.exact_x + 0.5)));
  camera.y = static_cast<std::int32_t>(detail::floor_of(detail::rounded(camera.exact_y + 0.5)));
  // More than the height and what its computation errs, which is far less than a unit.
  camera.z = static_cast<std::int32_t>(detail::floor_of(exact_z)) + 2;
  camera.z_straight =
      static_cast<std::int32_t>(detail::floor_of(detail::rounded(camera.exact_z_straight + 0.5)));
  camera.is_valid = true;
  return camera;
}

inline Camera Culling::camera(double x, double y, double z) const {
  double place[4];
  if (!to_frame(x, y, z, place)) return {};
  return rounded_camera(place[0], place[1], place[2], place[3]);
}

inline Camera Culling::camera_in_frame(double x_m, double y_m, double z_m) const {
  double z_straight_m = z_m;
  if (!is_flat_) {
    const double u = detail::rounded(x_m / scale_m_), v = detail::rounded(y_m / scale_m_);
    const double square = detail::rounded(detail::times(u, u) + detail::times(v, v));
    const double root = detail::rounded(std::sqrt(detail::rounded(1 + square)));
    z_straight_m = detail::rounded(
        z_m - detail::rounded(detail::times(bend_m_, square) / detail::rounded(root + 1)));
  }
  return rounded_camera(x_m, y_m, z_m, z_straight_m);
}

inline Frustum Culling::frustum(const Camera& camera, const double* planes, int count) const {
  using detail::rounded;
  using detail::times;
  Frustum frustum;
  for (int i = 0; i < count && i < Frustum::kMaxPlanes; ++i) {
    const double* plane = planes + 4 * i;
    // Of the frame without refraction: there, planes are planes.
    const double at_origin = rounded(detail::dot(plane, origin_) + plane[3]);
    double a = plane[0], b = plane[1], c = plane[2], d = at_origin;
    if (!is_flat_) {
      a = detail::dot(plane, east_);
      b = detail::dot(plane, north_);
      c = rounded(-at_origin / scale_m_);
      d = rounded(times(scale_m_, detail::dot(plane, up_)) + at_origin);
    }
    const double greatest = detail::most(detail::most(std::fabs(a), std::fabs(b)), std::fabs(c));
    if (!(greatest > 0) || !std::isfinite(greatest) || !camera.is_valid) continue;
    const double by = rounded(131072.0 / greatest);
    const double sum =
        rounded(rounded(rounded(times(a, camera.exact_x) + times(b, camera.exact_y)) +
                        times(c, camera.exact_z_straight)) +
                times(d, units_per_m_));
    const double at_camera = detail::floor_of(rounded(times(sum, by) + 0.5));
    constexpr double kFar = 1125899906842624.0;  // 2^50
    if (!(at_camera > -kFar)) continue;
    frustum.planes[frustum.count++] = {detail::floor_of(rounded(times(a, by) + 0.5)),
                                       detail::floor_of(rounded(times(b, by) + 0.5)),
                                       detail::floor_of(rounded(times(c, by) + 0.5)),
                                       detail::least(at_camera, kFar)};
  }
  return frustum;
}

/// Whether a box (low x, y, z, high x, y, z, units, without refraction) lies wholly beyond a plane.
/// Rounding of a, b and c moves the plane by half a sum of the distances, that of the camera and
/// of at_camera by less than 3 * 2^17.
inline bool Culling::is_outside(const Camera& camera, const Frustum& frustum,
                                const std::int32_t* box) {
  const double low_x = double(box[0]) - camera.x, high_x = double(box[3]) - camera.x;
  const double low_y = double(box[1]) - camera.y, high_y = double(box[4]) - camera.y;
  const double low_z = double(box[2]) - camera.z_straight;
  const double high_z = double(box[5]) - camera.z_straight;
  const double reach = detail::most(std::fabs(low_x), std::fabs(high_x)) +
                       detail::most(std::fabs(low_y), std::fabs(high_y)) +
                       detail::most(std::fabs(low_z), std::fabs(high_z));
  for (int i = 0; i < frustum.count; ++i) {
    const Frustum::Plane& p = frustum.planes[i];
    const double best = p.at_camera + p.a * (p.a >= 0 ? high_x : low_x) +
                        p.b * (p.b >= 0 ? high_y : low_y) + p.c * (p.c >= 0 ? high_z : low_z);
    if (2 * best + reach + 6 * 131072.0 < 0) return true;
  }
  return false;
}

inline Culling::Aim Culling::aim_at(const Camera& camera, const Tile& tile) const {
  Aim aim{double(camera.x), double(camera.y), double(camera.z), 1, 1};
  double farthest = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const double at = axis == 0 ? aim.x : aim.y;
    farthest = detail::most(farthest, std::fabs(at - tile.low[axis]));
    farthest = detail::most(farthest, std::fabs(at - tile.high[axis]));
  }
  while (farthest * aim.parts >= detail::kMostParts) aim.parts *= 0.5, aim.units *= 2;
  return aim;
}

/// floor(log2'(ratio^2) * 2^ring_bits) with straight lines between powers of two: exponent and
/// leading bits of a whole number below 2^50.
inline std::uint32_t Culling::ring_of(double ratio) const {
  const double square = ratio * ratio;
  std::uint64_t bits;
  std::memcpy(&bits, &square, sizeof bits);
  const std::uint32_t ring =
      static_cast<std::uint32_t>(bits >> (52 - ring_bits_)) - ((1023U + 32U) << ring_bits_);
  return ring < 63 ? ring : 63;
}

inline Culling::Look Culling::look_at(const Aim& aim, std::uint32_t group) const {
  using detail::cut;
  Look look;
  const double dx = aim.x - x_[group], dy = aim.y - y_[group];
  const double x = cut(detail::least(std::fabs(dx) * aim.parts, detail::kMostParts));
  const double y = cut(detail::least(std::fabs(dy) * aim.parts, detail::kMostParts));
  look.parts_x = x, look.parts_y = y;
  look.distance = cut(std::sqrt(x * x + y * y));
  double ratio = look.distance * aim.units * double(inverse_[group]);
  ratio = ratio < detail::kMostRatio ? ratio : detail::kMostRatio;
  look.ratio = cut(ratio > 0 ? ratio : 0);
  look.is_near = !(look.distance >= detail::kLeastParts && look.ratio >= detail::kRatioOne);
  const double tangent =
      cut(detail::least(x, y) * detail::kTangentOne / detail::most(detail::most(x, y), 1));
  const double eighth =
      cut(tangent * (detail::kSectorA * detail::kTangentOne - detail::kSectorB * tangent) *
          (1.0 / 17179869184.0));  // 2^-34
  const double quarter = y > x ? 2 * detail::kTangentOne - eighth : eighth;
  const double half = dx < 0 ? 4 * detail::kTangentOne - quarter : quarter;
  look.turn = dy < 0 ? 8 * detail::kTangentOne - half : half;
  const double sector = cut(look.turn * (sectors_ / 8) * (1.0 / 131072.0));
  look.sector = sector < sectors_ ? static_cast<std::uint32_t>(sector) : 0;
  look.ring = look.is_near ? 0 : ring_of(look.ratio);
  return look;
}

/// The code of the last of a sector's steps that is not beyond, 0 for none. Without branches, which
/// would be guessed wrong half of the time; rings rise from step to step.
inline std::uint32_t Culling::code_at(const std::uint16_t* steps, std::int32_t last) {
  int count = 0;
#if defined(__SSE2__)
  // Steps and the last one allowed are below 2^16; none is allowed within the circle, where it is
  // -1.
  const __m128i row = _mm_loadu_si128(reinterpret_cast<const __m128i*>(steps));
  const __m128i beyond = _mm_subs_epu16(row, _mm_set1_epi16(static_cast<short>(last)));
  const __m128i not_beyond = _mm_cmpeq_epi16(beyond, _mm_setzero_si128());
  const __m128i ones = _mm_and_si128(not_beyond, _mm_set1_epi16(1));
  const __m128i halves = _mm_sad_epu8(ones, _mm_setzero_si128());
  count = (_mm_cvtsi128_si32(halves) + _mm_extract_epi16(halves, 4)) & ~(last >> 31);
#else
  for (std::uint32_t i = 0; i < detail::kSteps; ++i) count += int(steps[i] <= last);
#endif
  const int has_step = int(count > 0);
  return (steps[count - has_step] & (detail::kSlopeCodes - 1)) * std::uint32_t(has_step);
}

/// The slope of a code, 2^-20; of code 0 that of code 1.
inline std::int64_t Culling::slope_of(std::uint32_t group, std::uint32_t code) const {
  return low_[group] + static_cast<std::int64_t>(
                           (std::uint64_t{code - std::uint32_t(code != 0)} * step_[group]) >> 10);
}

/// Farther where the line falls, nearer where it rises.
inline double Culling::safe_distance(double distance, double slope) {
  constexpr double kAside[] = {-3, 4};
  return distance + kAside[slope < 0];
}

inline bool Culling::hides(const Camera& camera, std::uint32_t group) const {
  if (!camera.is_valid) return false;
  for (std::uint32_t t = 0; t < tiles_; ++t) {
    const Tile& tile = tile_[t];
    if ((tile.flags & kIsFinest) == 0 || group < tile.first_group ||
        group >= tile.first_group + tile.groups)
      continue;
    const Aim aim = aim_at(camera, tile);
    const Look look = look_at(aim, group);
    const std::uint32_t code = look.is_near ? 0 : code_of(group, look);
    const double slope = double(slope_of(group, code));
    return code != 0 && (aim.z - height_[group]) * detail::kSlopeOne <
                            slope * safe_distance(look.distance, slope) * aim.units;
  }
  return false;
}

/// The same as hides() for up to 64 groups of a tile: first where the camera stands for all of
/// them, so that look-ups overlap.
inline void Culling::hidden_block(const Aim& aim, std::uint32_t first, std::uint32_t count,
                                  unsigned char* hidden) const {
  double distance[64], rise[64];
  std::int32_t sector[64], last[64];
  const std::uint16_t* steps[64];
  const std::size_t row = std::size_t{sectors_} * detail::kSteps;
  const std::uint16_t* const first_row = steps_ + std::size_t{first} * row;
  std::uint32_t done = 0;
  // Fetched group by group: what a miss takes is spent on where the camera is from the next ones.
  const auto fetch = [&](std::uint32_t some) {
    for (const std::uint32_t end = done + some; done < end; ++done) {
      steps[done] = first_row + (done * row + std::size_t(sector[done]) * detail::kSteps);
#if defined(__GNUC__)
      __builtin_prefetch(steps[done]);
#endif
    }
  };
#if defined(SCARP_RUNTIME_AVX2)
  if (has_avx2_)
    while (done + 4 <= count) {
      look_at_four(aim, first + done, distance + done, rise + done, sector + done, last + done);
      fetch(4);
    }
#endif
#if defined(__SSE2__)
  while (done + 2 <= count) {
    look_at_two(aim, first + done, distance + done, rise + done, sector + done, last + done);
    fetch(2);
  }
#endif
  while (done < count) {
    const Look look = look_at(aim, first + done);
    distance[done] = look.distance;
    rise[done] = (aim.z - height_[first + done]) * (detail::kSlopeOne * aim.parts);
    sector[done] = static_cast<std::int32_t>(look.sector);
    last[done] = look.is_near ? -1 : last_step_of(look.ring);
    fetch(1);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t code = code_at(steps[i], last[i]);
    const double slope = double(slope_of(first + i, code));
    hidden[i] = static_cast<unsigned char>(
        int(code != 0) & int(rise[i] < slope * safe_distance(distance[i], slope)));
  }
}

#if defined(__SSE2__)
/// look_at() for two groups side by side: the same operations one for one.
inline void Culling::look_at_two(const Aim& aim, std::uint32_t group, double* distances,
                                 double* rises, std::int32_t* sectors, std::int32_t* lasts) const {
  const auto all = [](double value) { return _mm_set1_pd(value); };
  const auto cut = [](__m128d v) { return _mm_cvtepi32_pd(_mm_cvttpd_epi32(v)); };
  const auto pick = [](__m128d mask, __m128d yes, __m128d no) {
    return _mm_or_pd(_mm_and_pd(mask, yes), _mm_andnot_pd(mask, no));
  };
  const auto whole = [](const std::int32_t* at) {
    return _mm_cvtepi32_pd(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at)));
  };
  const __m128d zero = _mm_setzero_pd(), sign = all(-0.0), one = all(detail::kTangentOne);
  const __m128d dx = _mm_sub_pd(all(aim.x), whole(x_ + group));
  const __m128d dy = _mm_sub_pd(all(aim.y), whole(y_ + group));
  const __m128d parts = all(aim.parts), most = all(detail::kMostParts);
  const __m128d x = cut(_mm_min_pd(_mm_mul_pd(_mm_andnot_pd(sign, dx), parts), most));
  const __m128d y = cut(_mm_min_pd(_mm_mul_pd(_mm_andnot_pd(sign, dy), parts), most));
  const __m128d distance = cut(_mm_sqrt_pd(_mm_add_pd(_mm_mul_pd(x, x), _mm_mul_pd(y, y))));
  const __m128d inverse = _mm_cvtps_pd(
      _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(inverse_ + group))));
  const __m128d ratio =
      cut(_mm_max_pd(_mm_min_pd(_mm_mul_pd(_mm_mul_pd(distance, all(aim.units)), inverse),
                                all(detail::kMostRatio)),
                     zero));
  const __m128d tangent =
      cut(_mm_div_pd(_mm_mul_pd(_mm_min_pd(x, y), one), _mm_max_pd(_mm_max_pd(x, y), all(1))));
  const __m128d slope = _mm_sub_pd(all(detail::kSectorA * detail::kTangentOne),
                                   _mm_mul_pd(all(detail::kSectorB), tangent));
  const __m128d eighth = cut(_mm_mul_pd(_mm_mul_pd(tangent, slope), all(1.0 / 17179869184.0)));
  const __m128d quarter =
      pick(_mm_cmpgt_pd(y, x), _mm_sub_pd(all(2 * detail::kTangentOne), eighth), eighth);
  const __m128d half =
      pick(_mm_cmplt_pd(dx, zero), _mm_sub_pd(all(4 * detail::kTangentOne), quarter), quarter);
  const __m128d turn =
      pick(_mm_cmplt_pd(dy, zero), _mm_sub_pd(all(8 * detail::kTangentOne), half), half);
  const __m128i sector = _mm_cvttpd_epi32(_mm_mul_pd(turn, all((sectors_ / 8) * (1.0 / 131072.0))));
  const __m128i is_within = _mm_cmplt_epi32(sector, _mm_set1_epi32(int(sectors_)));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(sectors), _mm_and_si128(sector, is_within));
  _mm_storeu_pd(distances, distance);
  _mm_storeu_pd(rises, _mm_mul_pd(_mm_sub_pd(all(aim.z), whole(height_ + group)),
                                  all(detail::kSlopeOne * aim.parts)));
  // As ring_of and last_step_of, in 64 bits each: the high halves are zero.
  const __m128i bits = _mm_srl_epi64(_mm_castpd_si128(_mm_mul_pd(ratio, ratio)),
                                     _mm_cvtsi32_si128(int(52 - ring_bits_)));
  const __m128i ring = _mm_sub_epi32(bits, _mm_set1_epi32(int((1023U + 32U) << ring_bits_)));
  const __m128i farthest = _mm_set1_epi32(63), is_last = _mm_cmpgt_epi32(ring, farthest);
  const __m128i limited =
      _mm_or_si128(_mm_and_si128(is_last, farthest), _mm_andnot_si128(is_last, ring));
  const __m128i last =
      _mm_or_si128(_mm_slli_epi32(limited, 10), _mm_set1_epi32(detail::kSlopeCodes - 1));
  const __m128d is_far = _mm_and_pd(_mm_cmpge_pd(distance, all(detail::kLeastParts)),
                                    _mm_cmpge_pd(ratio, all(detail::kRatioOne)));
  // Nearer ones get -1: no step counts.
  const __m128i kept =
      _mm_or_si128(last, _mm_andnot_si128(_mm_castpd_si128(is_far), _mm_set1_epi32(-1)));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(lasts),
                   _mm_shuffle_epi32(kept, _MM_SHUFFLE(3, 1, 2, 0)));
}
#endif

#if defined(SCARP_RUNTIME_AVX2)
/// The same for four, where the machine has AVX2.
__attribute__((target("avx2"))) inline void Culling::look_at_four(const Aim& aim,
                                                                  std::uint32_t group,
                                                                  double* distances, double* rises,
                                                                  std::int32_t* sectors,
                                                                  std::int32_t* lasts) const {
#define SCARP_ALL(value) _mm256_set1_pd(value)
#define SCARP_CUT(v) _mm256_cvtepi32_pd(_mm256_cvttpd_epi32(v))
#define SCARP_WHOLE(at) _mm256_cvtepi32_pd(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)))
  const __m256d zero = _mm256_setzero_pd(), sign = SCARP_ALL(-0.0);
  const __m256d dx = _mm256_sub_pd(SCARP_ALL(aim.x), SCARP_WHOLE(x_ + group));
  const __m256d dy = _mm256_sub_pd(SCARP_ALL(aim.y), SCARP_WHOLE(y_ + group));
  const __m256d parts = SCARP_ALL(aim.parts), most = SCARP_ALL(detail::kMostParts);
  const __m256d x =
      SCARP_CUT(_mm256_min_pd(_mm256_mul_pd(_mm256_andnot_pd(sign, dx), parts), most));
  const __m256d y =
      SCARP_CUT(_mm256_min_pd(_mm256_mul_pd(_mm256_andnot_pd(sign, dy), parts), most));
  const __m256d distance =
      SCARP_CUT(_mm256_sqrt_pd(_mm256_add_pd(_mm256_mul_pd(x, x), _mm256_mul_pd(y, y))));
  const __m256d inverse = _mm256_cvtps_pd(_mm_loadu_ps(inverse_ + group));
  const __m256d ratio = SCARP_CUT(_mm256_max_pd(
      _mm256_min_pd(_mm256_mul_pd(_mm256_mul_pd(distance, SCARP_ALL(aim.units)), inverse),
                    SCARP_ALL(detail::kMostRatio)),
      zero));
  const __m256d tangent =
      SCARP_CUT(_mm256_div_pd(_mm256_mul_pd(_mm256_min_pd(x, y), SCARP_ALL(detail::kTangentOne)),
                              _mm256_max_pd(_mm256_max_pd(x, y), SCARP_ALL(1))));
  const __m256d slope = _mm256_sub_pd(SCARP_ALL(detail::kSectorA * detail::kTangentOne),
                                      _mm256_mul_pd(SCARP_ALL(detail::kSectorB), tangent));
  const __m256d eighth =
      SCARP_CUT(_mm256_mul_pd(_mm256_mul_pd(tangent, slope), SCARP_ALL(1.0 / 17179869184.0)));
  const __m256d quarter =
      _mm256_blendv_pd(eighth, _mm256_sub_pd(SCARP_ALL(2 * detail::kTangentOne), eighth),
                       _mm256_cmp_pd(y, x, _CMP_GT_OQ));
  const __m256d half =
      _mm256_blendv_pd(quarter, _mm256_sub_pd(SCARP_ALL(4 * detail::kTangentOne), quarter),
                       _mm256_cmp_pd(dx, zero, _CMP_LT_OQ));
  const __m256d turn =
      _mm256_blendv_pd(half, _mm256_sub_pd(SCARP_ALL(8 * detail::kTangentOne), half),
                       _mm256_cmp_pd(dy, zero, _CMP_LT_OQ));
  const __m128i sector =
      _mm256_cvttpd_epi32(_mm256_mul_pd(turn, SCARP_ALL((sectors_ / 8) * (1.0 / 131072.0))));
  const __m128i is_within = _mm_cmplt_epi32(sector, _mm_set1_epi32(int(sectors_)));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(sectors), _mm_and_si128(sector, is_within));
  _mm256_storeu_pd(distances, distance);
  _mm256_storeu_pd(rises,
                   _mm256_mul_pd(_mm256_sub_pd(SCARP_ALL(aim.z), SCARP_WHOLE(height_ + group)),
                                 SCARP_ALL(detail::kSlopeOne * aim.parts)));
  const __m256i low_halves = _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6);
  const __m256i bits = _mm256_srl_epi64(_mm256_castpd_si256(_mm256_mul_pd(ratio, ratio)),
                                        _mm_cvtsi32_si128(int(52 - ring_bits_)));
  const __m256d is_far =
      _mm256_and_pd(_mm256_cmp_pd(distance, SCARP_ALL(detail::kLeastParts), _CMP_GE_OQ),
                    _mm256_cmp_pd(ratio, SCARP_ALL(detail::kRatioOne), _CMP_GE_OQ));
  const __m128i ring =
      _mm_sub_epi32(_mm256_castsi256_si128(_mm256_permutevar8x32_epi32(bits, low_halves)),
                    _mm_set1_epi32(int((1023U + 32U) << ring_bits_)));
  const __m128i is_kept =
      _mm256_castsi256_si128(_mm256_permutevar8x32_epi32(_mm256_castpd_si256(is_far), low_halves));
  const __m128i last = _mm_or_si128(_mm_slli_epi32(_mm_min_epi32(ring, _mm_set1_epi32(63)), 10),
                                    _mm_set1_epi32(detail::kSlopeCodes - 1));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(lasts),
                   _mm_or_si128(last, _mm_andnot_si128(is_kept, _mm_set1_epi32(-1))));
#undef SCARP_ALL
#undef SCARP_CUT
#undef SCARP_WHOLE
}
#endif

/// Writes those of up to 64 groups that are not hidden and may be in the frustum.
inline std::uint32_t Culling::show(const Camera& camera, const Frustum* frustum,
                                   std::uint32_t first, std::uint32_t count,
                                   const unsigned char* hidden, std::uint32_t* visible) const {
  std::uint32_t found = 0;
  if (frustum == nullptr || frustum->count == 0) {
    for (std::uint32_t i = 0; i < count; ++i) {
      visible[found] = id_[first + i];
      found += hidden[i] == 0;
    }
    return found;
  }
  std::uint32_t block = first / detail::kBlockGroups;
  bool is_block_outside = is_outside(camera, *frustum, block_ + std::size_t{block} * 6);
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((first + i) / detail::kBlockGroups != block) {
      block = (first + i) / detail::kBlockGroups;
      is_block_outside = is_outside(camera, *frustum, block_ + std::size_t{block} * 6);
    }
    if (hidden[i] != 0 || is_block_outside) continue;
    if (is_outside(camera, *frustum, box_ + std::size_t{first + i} * 6)) continue;
    visible[found++] = id_[first + i];
  }
  return found;
}

inline std::uint32_t Culling::visible(const Camera& camera, const Frustum* frustum,
                                      std::uint32_t* visible) const {
  std::uint32_t found = 0;
  unsigned char hidden[64];
  for (std::uint32_t t = 0; t < tiles_; ++t) {
    const Tile& tile = tile_[t];
    if ((tile.flags & kIsFinest) == 0) continue;
    const Aim aim = aim_at(camera, tile);
    const std::uint32_t end = tile.first_group + tile.groups;
    for (std::uint32_t first = tile.first_group; first < end;) {
      const std::uint32_t count = end - first < 64 ? end - first : 64;
      if (camera.is_valid)
        hidden_block(aim, first, count, hidden);
      else
        std::memset(hidden, 0, sizeof hidden);
      found += show(camera, frustum, first, count, hidden, visible + found);
      first += count;
    }
  }
  return found;
}

inline TileAnswer Culling::tile_answer(const Camera& camera, std::uint32_t i) const {
  const Tile& tile = tile_[i];
  if (!camera.is_valid) return TileAnswer::kUnknown;
  // A unit for the rounding of x and y; z is above the true one by less than three.
  if (camera.x > tile.inner[0] && camera.x < tile.inner[2] && camera.y > tile.inner[1] &&
      camera.y < tile.inner[3] && double(camera.z) - 3 > tile.high[2])
    return TileAnswer::kNotOccluded;
  Box box;
  box.low_x = tile.low[0], box.low_y = tile.low[1];
  box.high_x = tile.high[0], box.high_y = tile.high[1];
  box.top = tile.high[2];
  box.is_valid = true;
  if (!box_visible(camera, box)) return TileAnswer::kOccluded;
  if ((tile.flags & kIsFinest) == 0 || (tile.flags & kHasOrphans) != 0 || tile.groups == 0)
    return TileAnswer::kUnknown;
  const Aim aim = aim_at(camera, tile);
  unsigned char hidden[64];
  const std::uint32_t end = tile.first_group + tile.groups;
  for (std::uint32_t first = tile.first_group; first < end;) {
    const std::uint32_t count = end - first < 64 ? end - first : 64;
    hidden_block(aim, first, count, hidden);
    for (std::uint32_t k = 0; k < count; ++k)
      if (hidden[k] == 0) return TileAnswer::kUnknown;
    first += count;
  }
  return TileAnswer::kOccluded;
}

inline Box Culling::box_in_frame(double low_x_m, double low_y_m, double high_x_m, double high_y_m,
                                 double top_m) const {
  // One unit more than rounding outwards takes, for the errors of the numbers themselves.
  const double low_x = detail::floor_of(low_x_m * units_per_m_) - 1;
  const double low_y = detail::floor_of(low_y_m * units_per_m_) - 1;
  const double high_x = detail::floor_of(high_x_m * units_per_m_) + 2;
  const double high_y = detail::floor_of(high_y_m * units_per_m_) + 2;
  const double top = detail::floor_of(top_m * units_per_m_) + 2;
  if (!(low_x > -detail::kReach && low_y > -detail::kReach && high_x < detail::kReach &&
        high_y < detail::kReach && low_x <= high_x && low_y <= high_y &&
        std::fabs(top) < detail::kReach))
    return {};
  Box box;
  box.low_x = static_cast<std::int32_t>(low_x);
  box.low_y = static_cast<std::int32_t>(low_y);
  box.high_x = static_cast<std::int32_t>(high_x);
  box.high_y = static_cast<std::int32_t>(high_y);
  box.top = static_cast<std::int32_t>(top);
  box.is_valid = true;
  return box;
}

/// Without refraction the hull of the corners is that of their places. What refraction adds is
/// convex in x and y, so no more anywhere than at the corner where it is most.
inline Box Culling::box(const double* corners, int count) const {
  double low[2] = {0, 0}, high[2] = {0, 0}, top = 0, bend = 0;
  if (count < 1) return {};
  for (int i = 0; i < count; ++i) {
    double place[4];
    if (!to_frame(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2], place)) return {};
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = i == 0 ? place[axis] : detail::least(low[axis], place[axis]);
      high[axis] = i == 0 ? place[axis] : detail::most(high[axis], place[axis]);
    }
    top = i == 0 ? place[3] : detail::most(top, place[3]);
    bend = detail::most(bend, detail::rounded(place[2] - place[3]));
  }
  return box_in_frame(low[0], low[1], high[0], high[1], detail::rounded(top + bend));
}

/// Whether the ground is known to lie above a height all over a rectangle. Looked up on the level
/// of the pyramid where the rectangle takes few cells.
inline bool Culling::is_ground_above(double low_x, double low_y, double high_x, double high_y,
                                     double height) const {
  double cell = detail::power_of_2(static_cast<int>(cell_bits_));
  double first_column = first_column_, first_row = first_row_;
  std::uint64_t columns = columns_, rows = rows_;
  const std::int16_t* least = least_;
  // Cells of the first level, from the grid's corner.
  double left = detail::floor_of(low_x / cell) - first_column;
  double right = detail::floor_of(high_x / cell) - first_column;
  double below = detail::floor_of(low_y / cell) - first_row;
  double above = detail::floor_of(high_y / cell) - first_row;
  if (!(left >= 0 && below >= 0 && right < double(columns) && above < double(rows))) return false;
  while ((right - left > 3 || above - below > 3) && (columns > 1 || rows > 1)) {
    least += columns * rows;
    columns = (columns + 1) / 2, rows = (rows + 1) / 2;
    left = detail::floor_of(left / 2), right = detail::floor_of(right / 2);
    below = detail::floor_of(below / 2), above = detail::floor_of(above / 2);
  }
  const double step = detail::power_of_2(static_cast<int>(height_bits_));
  for (double row = below; row <= above; ++row)
    for (double column = left; column <= right; ++column) {
      const std::int16_t code =
          least[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(column)];
      if (code == detail::kNoHeight || !(double(base_) + code * step > height)) return false;
    }
  return true;
}

inline bool Culling::box_visible(const Camera& camera, const Box& box) const {
  Box cell;
  cell.low_x = cell.high_x = camera.x;
  cell.low_y = cell.high_y = camera.y;
  cell.top = camera.z;
  cell.is_valid = camera.is_valid;
  return box_visible(cell, box);
}

inline bool Culling::box_visible(const Box& cell, const Box& box) const {
  if (!cell.is_valid || !box.is_valid || columns_ == 0) return true;
  const double top = double(base_) + highest_ * detail::power_of_2(static_cast<int>(height_bits_));
  // Ways from middle to middle, in cells: about one look-up a cell.
  const double size = detail::power_of_2(static_cast<int>(cell_bits_));
  const double way_x = (double(box.low_x) + box.high_x) - (double(cell.low_x) + cell.high_x);
  const double way_y = (double(box.low_y) + box.high_y) - (double(cell.low_y) + cell.high_y);
  const double way = detail::most(std::fabs(way_x), std::fabs(way_y)) / (2 * size);
  const double parts = detail::least(detail::floor_of(way) + 2, 4096);
  for (double part = parts - 1; part >= 1; --part) {
    const auto between = [&](std::int32_t from, std::int32_t to) {
      return detail::floor_of((from * (parts - part) + to * part) / parts);
    };
    // Rounded outwards and upwards; a unit each way for the rounding of a camera.
    const double height = between(cell.top, box.top) + 1;
    if (height >= top) continue;
    if (is_ground_above(between(cell.low_x, box.low_x) - 1, between(cell.low_y, box.low_y) - 1,
                        between(cell.high_x, box.high_x) + 2, between(cell.high_y, box.high_y) + 2,
                        height))
      return false;
  }
  return true;
}

// ---------------------------------------------------------------------------------------------

/// Looks at a group and tells how far, in units along each axis, the camera may go before anything
/// that decided can change. A move of u parts changes a distance in parts by less than 1.5 u + 3,
/// and the turn, in eighths * 2^17, by less than 2.5 * 2^17 (u + 2) / distance + 5.
inline double MovingView::look_again(const Culling::Aim& aim, std::uint32_t group,
                                     unsigned char* is_hidden) const {
  const Culling& c = culling_;
  const Culling::Look look = c.look_at(aim, group);
  const double a_part = aim.units * double(c.inverse_[group]);  // of the ratio
  *is_hidden = 0;
  double free = 0;  // parts
  if (look.is_near) {
    free = detail::most(detail::kLeastParts - look.distance,
                        (detail::kRatioOne - look.ratio - 1) / a_part) /
               1.5 -
           3;
  } else {
    const double sectors = c.sectors_ / 8;
    const double turned = look.turn * sectors;
    const double past = turned - detail::floor_of(turned / 131072) * 131072;
    const double turn = detail::least(past, 131072 - past) / sectors;
    free = (turn - 5) * look.distance / 327680 - 2;
    free = detail::least(free, (look.distance - detail::kLeastParts) / 1.5 - 2);
    const double square = look.ratio * look.ratio;
    const double rings = double(1U << c.ring_bits_);
    const double octave = detail::power_of_2(32 + static_cast<int>(look.ring >> c.ring_bits_));
    const double place = double(look.ring & ((1U << c.ring_bits_) - 1));
    const double begin = octave * (1 + place / rings);
    const double end = look.ring == 63 ? square * 1.125 : octave * (1 + (place + 1) / rings);
    const double ratio = detail::least(square - begin, end - square - 1) / (2.125 * look.ratio);
    free = detail::least(free, ((ratio - 1) / a_part - 3) / 1.5);
    const std::uint32_t code = c.code_of(group, look);
    if (code != 0) {
      const double slope = double(c.slope_of(group, code));
      const double rise = (aim.z - c.height_[group]) * detail::kSlopeOne;
      const double line = slope * Culling::safe_distance(look.distance, slope) * aim.units;
      *is_hidden = rise < line;
      const double gap = std::fabs(rise - line) / aim.units;
      const double steep = std::fabs(slope);
      free = detail::least(free, (gap - 3 * steep) / (detail::kSlopeOne + 1.5 * steep) - 1);
    }
  }
  return free > 0 ? free * aim.units : 0;
}

inline std::uint32_t MovingView::visible(const Camera& camera, const Frustum* frustum,
                                         std::uint32_t* visible) {
  const Culling& c = culling_;
  looked_at_ = 0;
  if (!camera.is_valid) return c.visible(camera, frustum, visible);
  travelled_ += detail::most(
      detail::most(std::fabs(double(camera.x) - last_.x), std::fabs(double(camera.y) - last_.y)),
      std::fabs(double(camera.z) - last_.z));
  last_ = camera;
  std::uint32_t found = 0;
  unsigned char hidden[64];
  for (std::uint32_t t = 0; t < c.tiles_; ++t) {
    const Tile& tile = c.tile_[t];
    if ((tile.flags & kIsFinest) == 0) continue;
    const Culling::Aim aim = c.aim_at(camera, tile);
    const bool is_new = units_[t] != aim.units;
    units_[t] = aim.units;
    const std::uint32_t end = tile.first_group + tile.groups;
    for (std::uint32_t first = tile.first_group; first < end;) {
      const std::uint32_t count = end - first < 64 ? end - first : 64;
      for (std::uint32_t i = 0; i < count; ++i) {
        Kept& kept = kept_[first + i];
        if (is_new || !(travelled_ <= kept.until)) {
          ++looked_at_;
          kept.until = travelled_ + look_again(aim, first + i, &kept.is_hidden);
        }
        hidden[i] = kept.is_hidden;
      }
      found += c.show(camera, frustum, first, count, hidden, visible + found);
      first += count;
    }
  }
  return found;
}

}  // namespace runtime
}  // namespace scarp
