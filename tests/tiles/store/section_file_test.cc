#include "tiles/store/section_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "core/culling/certified_culling.h"
#include "core/error/error.h"
#include "core/occlusion/splitmix64.h"
#include "tests/tiles/limits.h"
#include "tests/tiles/reseal.h"
#include "tests/tiles/small_scene.h"
#include "tests/tiles/temporary_folder.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

using Bytes = std::vector<std::byte>;
using test::TemporaryFolder;

/// What kind of file it is, its bytes, and how it is read to the end.
struct KindOfFile {
  std::string name;
  Bytes bytes;
  std::function<void(const SectionFile&)> read;
};

std::vector<KindOfFile> kinds_of_file() {
  const Tin tin = test::grid_tin(3, 3);
  const std::vector<std::int64_t> samples = {0, 1, 2, 3, -1, 5, 6, 7, 8};
  return {
      {"tin", tin_writer(tin, samples).to_bytes(),
       [](const SectionFile& file) {
         // what is read without complaint can be walked: the sanitizers look on
         (void)check_tin(read_sampled_tin(file).tin);
       }},
      {"compact tin", compact_tin_writer(tin, {{0, 1, 2, 3, 4, 5, 6, 7, 8}}, 3).to_bytes(),
       [](const SectionFile& file) { (void)check_tin(read_sampled_tin(file).tin); }},
      {"horizon", horizon_writer(test::small_horizons(tin)).to_bytes(),
       [](const SectionFile& file) { read_horizon(file); }},
      {"certified", groups_writer(test::small_certified_groups(tin)).to_bytes(),
       [](const SectionFile& file) {
         // what is read without complaint can be asked: the sanitizers look on
         const Groups groups = read_groups(file);
         if (!groups.has_certified()) return;
         CertifiedCulling culling(groups.certified);
         for (const double x_m : {5.0, 30.0, -1e8})
           for (const double y_m : {-5.0, 70.0, 1e8})
             EXPECT_LE(culling.visible({{x_m, y_m, 2}, {}}).visible_groups.size(),
                       groups.leaf_count);
       }},
      {"groups", groups_writer(test::small_groups(tin)).to_bytes(), [](const SectionFile& file) {
         const Groups groups = read_groups(file);
         for (GroupIndex n = 0; n < groups.nodes.size(); ++n) {
           for (std::int32_t s = 0; s < groups.regions.layout.count; ++s) {
             const RegionView region = groups.regions.at(n, s);
             double sum = 0;
             for (std::uint32_t i = 0; i < region.count; ++i) sum += region.points[i].u_m;
             EXPECT_EQ(sum, sum);
           }
         }
       }}};
}

/// The message of the Error{kCorrupt} that reading gives, or "" where it gives none.
std::string complaint(const Bytes& bytes, const std::function<void(const SectionFile&)>& read,
                      Verify verify = Verify::kEverything) {
  try {
    read(SectionFile::from_memory(bytes, "f", verify));
    return "";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
    return error.what();
  }
}

TEST(SectionFile, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  const std::vector<double> x = {1.5, -2.25, 1e300};
  const std::vector<std::uint8_t> few = {7};
  const std::vector<std::int32_t> none;
  const std::vector<float> pairs = {1, 2, 3, 4};
  SectionFileWriter writer({'T', 'E', 'S', 'T'}, 3);
  writer.add<std::uint8_t>("few", std::span(few));
  writer.add<std::int32_t>("none", std::span(none));
  writer.add<double>("x", std::span(x));
  writer.add_rows<float>("pairs", std::span(pairs), 2);
  writer.write(folder / "f", Existing::kRefuse);
  const SectionFile file = SectionFile::open(folder / "f", Verify::kEverything);
  file.require({'T', 'E', 'S', 'T'}, 3);
  const auto back = file.section<double>("x");
  EXPECT_TRUE(std::equal(back.begin(), back.end(), x.begin(), x.end()));
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(back.data()) % 64, 0U);
  EXPECT_EQ(file.section<std::uint8_t>("few")[0], 7);
  EXPECT_TRUE(file.section<std::int32_t>("none").empty());
  EXPECT_EQ(file.section<float>("pairs", 2).size(), 4U);
  EXPECT_EQ(file.width("pairs"), 2U);
  const std::string text = test::read_text(folder / "f");
  const std::span<const std::byte> on_disk = std::as_bytes(std::span(text));
  const Bytes in_memory = writer.to_bytes();
  EXPECT_TRUE(std::equal(on_disk.begin(), on_disk.end(), in_memory.begin(), in_memory.end()));
}

TEST(SectionFile, SaysWhatIsWrong) {
  const KindOfFile tin = kinds_of_file()[0];
  const auto says = [&](const std::string& part,
                        const std::function<void(const SectionFile&)>& use) {
    const std::string text = complaint(tin.bytes, use);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says("'f': section \"nothing\" is missing",
       [](const SectionFile& f) { f.section<double>("nothing"); });
  says("section \"position\" holds float64 x 3 where float32 x 3 was expected",
       [](const SectionFile& f) { f.section<float>("position", 3); });
  says("section \"position\" holds float64 x 3 where float64 x 1 was expected",
       [](const SectionFile& f) { f.section<double>("position"); });
  says("kind \"TIN \" where \"GRPS\" was expected", [](const SectionFile& f) { read_groups(f); });
  says("version 1 of kind \"TIN \" where 2 was expected",
       [](const SectionFile& f) { f.require(kTinKind, 2); });
}

TEST(SectionFile, EveryTruncationIsAnError) {
  for (const KindOfFile& kind : kinds_of_file()) {
    for (std::size_t size = 0; size < kind.bytes.size(); ++size) {
      const Bytes cut(kind.bytes.begin(), kind.bytes.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_NE(complaint(cut, kind.read, Verify::kStructure), "") << kind.name << " " << size;
      Bytes sealed = cut;  // a size and checksums that fit must not help
      test::reseal(sealed);
      EXPECT_NE(complaint(sealed, kind.read), "") << kind.name << " " << size;
    }
    Bytes longer = kind.bytes;
    longer.push_back(std::byte{0});
    EXPECT_NE(complaint(longer, kind.read, Verify::kStructure), "");
    test::reseal(longer);
    EXPECT_NE(complaint(longer, kind.read), "");
  }
}

TEST(SectionFile, EveryFlippedByteIsAnError) {
  for (const KindOfFile& kind : kinds_of_file()) {
    EXPECT_EQ(complaint(kind.bytes, kind.read), "");
    for (std::size_t at = 0; at < kind.bytes.size(); ++at) {
      for (const int mask : {0x01, 0x10, 0x80, 0xff}) {
        Bytes flipped = kind.bytes;
        flipped[at] ^= std::byte(mask);
        EXPECT_NE(complaint(flipped, kind.read), "") << kind.name << " byte " << at;
        // behind fitting checksums it may be read or refused, but never more
        complaint(flipped, kind.read, Verify::kStructure);
        test::reseal(flipped);
        complaint(flipped, kind.read);
      }
    }
  }
}

TEST(SectionFile, HeadIsCheckedWithoutReadingTheArrays) {
  const KindOfFile tin = kinds_of_file()[0];
  const std::size_t head_size = 64 + 4 * 64;
  for (std::size_t at = 0; at < head_size; ++at) {
    Bytes flipped = tin.bytes;
    flipped[at] ^= std::byte{0x40};
    EXPECT_NE(complaint(
                  flipped, [](const SectionFile&) {}, Verify::kStructure),
              "")
        << at;
  }
}

TEST(SectionFile, TheTableIsCheckedBehindItsChecksum) {
  const KindOfFile tin = kinds_of_file()[0];
  const auto complains = [&](const std::string& part, std::size_t at, std::uint64_t value,
                             std::size_t size) {
    Bytes changed = tin.bytes;
    std::memcpy(changed.data() + at, &value, size);
    test::reseal(changed);
    const std::string text = complaint(changed, [](const SectionFile&) {});
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const std::size_t second = 64 + 64;  // the entry of "triangle"
  complains("section 1 has no proper name", second, 0, 1);
  complains("section 1 has no proper name", second, ' ', 1);
  complains("section 1 has no proper name", second + 12, 'x', 1);
  complains("has the unknown type 8", second + 16, 8, 4);
  complains("elements without numbers", second + 20, 0, 4);
  complains("\"triangle\" (offset ", second + 20, 0xffffffff, 4);
  complains("\"triangle\" (offset ", second + 24, ~std::uint64_t{0}, 8);
  complains("\"triangle\" (offset ", second + 32, 320, 8);
  complains("bytes of sections in a file of", 64 + 3 * 64 + 24, 0, 8);
  complains("room for", 24, 0xffffffff, 4);
  Bytes twice = tin.bytes;
  std::copy_n(twice.begin() + 64, 16, twice.begin() + static_cast<std::ptrdiff_t>(second));
  test::reseal(twice);
  EXPECT_NE(complaint(twice, [](const SectionFile&) {}).find("is there twice"), std::string::npos);
}

TEST(SectionFile, MissingFilesAreTheCallersInput) {
  const TemporaryFolder folder;
  try {
    SectionFile::open(folder / "none");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
  }
  test::write_text(folder / "empty", "");
  try {
    SectionFile::open(folder / "empty");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  }
}

TEST(SectionFile, FullDiskLeavesNothingBehind) {
  const TemporaryFolder folder;
  const Tin tin = test::grid_tin(100, 100);
  {
    const test::FullDisk full(100'000);
    EXPECT_THROW(write_tin(folder / "t", tin, {}, Existing::kRefuse), Error);
  }
  EXPECT_TRUE(folder.names().empty());
  write_tin(folder / "t", tin, {}, Existing::kRefuse);
  EXPECT_EQ(read_tin(SectionFile::open(folder / "t")).vertices, tin.vertices);
}

TEST(TinFile, RoundTrip) {
  const TemporaryFolder folder;
  const Tin tin = test::grid_tin(7, 5);
  std::vector<std::int64_t> samples(tin.vertices.size(), -1);
  samples[3] = 1'000'000'000'000;
  write_tin(folder / "t", tin, samples, Existing::kRefuse);
  const SectionFile file = SectionFile::open(folder / "t", Verify::kEverything);
  const SampledTin back = read_sampled_tin(file);
  EXPECT_EQ(back.tin.vertices, tin.vertices);
  EXPECT_EQ(back.tin.triangles, tin.triangles);
  EXPECT_EQ(back.tin.neighbours, tin.neighbours);
  EXPECT_EQ(back.sample_of_vertex, samples);
  EXPECT_TRUE(read_sampled_tin(SectionFile::from_memory(tin_writer(tin).to_bytes(), "f"))
                  .sample_of_vertex.empty());
  EXPECT_THROW(write_tin(folder / "t", tin, {}, Existing::kRefuse), Error);
}

TEST(TinFile, EmptyTin) {
  const Bytes bytes = tin_writer(Tin{}).to_bytes();
  EXPECT_TRUE(read_tin(SectionFile::from_memory(bytes, "f")).vertices.empty());
}

void expect_same(const SampledTin& back, const Tin& tin, const std::vector<std::int64_t>& samples) {
  EXPECT_EQ(back.tin.vertices, tin.vertices);
  EXPECT_EQ(back.tin.triangles, tin.triangles);
  EXPECT_EQ(back.tin.neighbours, tin.neighbours);
  EXPECT_EQ(back.sample_of_vertex, samples);
}

TEST(TinFile, CompactRoundTripFarFromEverything) {
  constexpr std::int64_t kColumns = 2'000'000'000;
  Tin tin = test::grid_tin(40, 30, -12'000);
  for (Position& p : tin.vertices) p = {p.x_m + 0x1p26, p.y_m - 0x1p25 - 0x1p-12, p.z_m};
  std::vector<std::int64_t> samples;
  for (std::int64_t row = 0; row < 30; ++row)
    for (std::int64_t column = 0; column < 40; ++column)
      samples.push_back((1'000'000'000 + 8 * row) * kColumns + 1'900'000'000 + 8 * column);
  const Bytes bytes = compact_tin_writer(tin, samples, kColumns).to_bytes();
  EXPECT_LT(bytes.size(), tin_writer(tin, samples).to_bytes().size() / 10);
  expect_same(read_sampled_tin(SectionFile::from_memory(bytes, "compact", Verify::kEverything)),
              tin, samples);
}

/// A grid of which cells are missing: holes, islands, and vertices where parts touch. Its heights
/// and places have no order.
SampledTin torn_grid(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto columns = static_cast<std::uint32_t>(2 + random() % 12);
  const auto rows = static_cast<std::uint32_t>(2 + random() % 12);
  const std::uint64_t keep_of_8 = random() % 9;
  const Tin whole = test::grid_tin(columns, rows);
  Tin torn;
  for (std::size_t t = 0; t < whole.triangles.size(); t += 2)
    if (random() % 8 < keep_of_8)
      for (const std::size_t half : {t, t + 1}) torn.triangles.push_back(whole.triangles[half]);
  SampledTin mesh;
  std::vector<VertexIndex> new_vertex(whole.vertices.size(), kNone);
  for (const auto& triangle : torn.triangles)
    for (const VertexIndex v : triangle) new_vertex[v] = 0;
  for (VertexIndex v = 0; v < whole.vertices.size(); ++v) {
    if (new_vertex[v] == kNone) continue;
    new_vertex[v] = static_cast<VertexIndex>(mesh.tin.vertices.size());
    const auto shift = [&](double most) {
      return round_to_lattice(most * static_cast<double>(random() >> 11) * 0x1p-53);
    };
    const Position& p = whole.vertices[v];
    mesh.tin.vertices.push_back({p.x_m + shift(1), p.y_m + shift(1), shift(8000)});
    mesh.sample_of_vertex.push_back(v);
  }
  for (auto triangle : torn.triangles) {
    for (VertexIndex& v : triangle) v = new_vertex[v];
    std::ranges::rotate(triangle, std::ranges::min_element(triangle));
    mesh.tin.triangles.push_back(triangle);
  }
  std::ranges::sort(mesh.tin.triangles);
  connect_neighbours(mesh.tin);
  return mesh;
}

TEST(TinFile, CompactRoundTripOfAMeshAsWideAsTheLatticeReaches) {
  Tin tin = test::grid_tin(12, 12);
  const Bounds bounds = bounds_of(tin.vertices);
  const double more = 0x1p27 / (bounds.high.x_m - bounds.low.x_m);
  std::vector<std::int64_t> samples;
  for (Position& p : tin.vertices) {
    p = {round_to_lattice(more * p.x_m), round_to_lattice(more * p.y_m), p.z_m};
    samples.push_back(static_cast<std::int64_t>(samples.size()));
  }
  const Bytes bytes = compact_tin_writer(tin, samples, 12).to_bytes();
  expect_same(read_sampled_tin(SectionFile::from_memory(bytes, "wide")), tin, samples);
}

TEST(TinFile, CompactRoundTripOfTornMeshes) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SampledTin mesh = torn_grid(seed);
    std::vector<double> heights_m;  // none, any, whole feet with a few that are not
    for (std::size_t v = 0; v < mesh.tin.vertices.size() && seed % 3 > 0; ++v) {
      double& z_m = mesh.tin.vertices[v].z_m;
      heights_m.push_back(seed % 3 == 1 ? z_m : std::nearbyint(z_m) * 0.3048);
      if (seed % 3 == 2) z_m = round_to_lattice(1.001 * heights_m.back() + (v % 200 == 7 ? 5 : 0));
    }
    const Bytes bytes =
        compact_tin_writer(mesh.tin, mesh.sample_of_vertex, 16, heights_m).to_bytes();
    expect_same(read_sampled_tin(SectionFile::from_memory(bytes, "torn")), mesh.tin,
                mesh.sample_of_vertex);
  }
}

TEST(TinFile, HeightsInWholeMetresTakeFewerBytes) {
  Tin tin = test::grid_tin(60, 60);
  std::vector<std::int64_t> samples;
  std::vector<double> heights_m;
  std::mt19937_64 random(1);
  for (Position& p : tin.vertices) {
    samples.push_back(static_cast<std::int64_t>(samples.size()));
    heights_m.push_back(static_cast<double>(random() % 64));
    p.z_m = round_to_lattice(0.99 * heights_m.back() + 1e-5 * p.x_m * p.y_m);
  }
  const auto bytes = [&](std::span<const double> heights) {
    return compact_tin_writer(tin, samples, 60, heights).to_bytes().size();
  };
  EXPECT_LT(bytes(heights_m) + 3600, bytes({}));  // a byte a vertex
}

TEST(TinFile, CompactRefusesTrianglesThatTurnOver) {
  Tin tin = test::grid_tin(3, 3);
  const std::vector<std::int64_t> samples = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  std::swap(tin.vertices[4].x_m, tin.vertices[0].x_m);
  const std::string text = complaint(compact_tin_writer(tin, samples, 3).to_bytes(), read_tin);
  EXPECT_NE(text.find("counter-clockwise"), std::string::npos) << text;
}

TEST(TinFile, RefusesWhatCannotBeWalked) {
  const auto complains = [](const std::string& part, const std::function<void(Tin&)>& damage) {
    Tin tin = test::grid_tin(3, 3);
    damage(tin);
    const std::string text = complaint(tin_writer(tin).to_bytes(), read_tin);
    EXPECT_NE(text.find(part), std::string::npos) << part << " | " << text;
  };
  complains("triangle 1 has vertex 9 of 9", [](Tin& t) { t.triangles[1][2] = 9; });
  complains("triangle 0 is not counter-clockwise",
            [](Tin& t) { std::swap(t.triangles[0][0], t.triangles[0][1]); });
  complains("vertex 4 is not on the lattice", [](Tin& t) { t.vertices[4].y_m = 0.1; });
  complains("vertex 5 is not on the lattice",
            [](Tin& t) { t.vertices[5].z_m = std::numeric_limits<double>::quiet_NaN(); });
  complains("vertex 6 is not on the lattice", [](Tin& t) { t.vertices[6].x_m = 0x1p28; });
  complains("wrong neighbour", [](Tin& t) { t.neighbours[0][0] = 8; });
  complains("wrong neighbour", [](Tin& t) { t.neighbours[0][0] = 3; });
  complains("wrong neighbour", [](Tin& t) { t.neighbours[1] = {kNone, kNone, kNone}; });
  complains("triangle 1 has the wrong neighbour 2", [](Tin& t) {  // two on one side of an edge
    t.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, 0}, {0, -10, 0}};
    t.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
    t.neighbours = {{kNone, kNone, 2}, {kNone, kNone, 2}, {kNone, kNone, 0}};
  });
}

TEST(HorizonFile, RoundTrip) {
  const HorizonTable table = test::small_horizons(test::grid_tin(4, 4));
  const Bytes bytes = horizon_writer(table).to_bytes();
  const HorizonTable back = read_horizon(SectionFile::from_memory(bytes, "f"));
  EXPECT_EQ(back.layout, table.layout);
  EXPECT_EQ(back.horizon_vertex, table.horizon_vertex);
}

TEST(HorizonFile, RefusesVerticesThatDoNotExist) {
  HorizonTable table = test::small_horizons(test::grid_tin(3, 3));
  table.horizon_vertex[6] = 9;
  EXPECT_NE(complaint(horizon_writer(table).to_bytes(), read_horizon)
                .find("vertex 1 has its horizon at vertex 9 of 9"),
            std::string::npos);
}

TEST(GroupsFile, RoundTrip) {
  const Groups groups = test::small_groups(test::grid_tin(4, 3));
  const Bytes bytes = groups_writer(groups).to_bytes();
  const Groups back = read_groups(SectionFile::from_memory(bytes, "f"));
  EXPECT_EQ(back.group_of_triangle, groups.group_of_triangle);
  EXPECT_EQ(back.leaf_count, groups.leaf_count);
  EXPECT_EQ(back.regions.layout, groups.regions.layout);
  EXPECT_EQ(back.regions.first, groups.regions.first);
  EXPECT_EQ(back.regions.end_slope, groups.regions.end_slope);
  ASSERT_EQ(back.regions.points.size(), groups.regions.points.size());
  EXPECT_EQ(back.regions.points.back().u_m, groups.regions.points.back().u_m);
  ASSERT_EQ(back.nodes.size(), 3U);
  EXPECT_EQ(back.nodes[2].children, groups.nodes[2].children);
  EXPECT_EQ(back.nodes[1].radius_m, 8.5);
  EXPECT_EQ(groups_writer(back).to_bytes(), bytes);
  EXPECT_TRUE(
      read_groups(SectionFile::from_memory(groups_writer(Groups{}).to_bytes(), "f")).nodes.empty());
}

TEST(GroupsFile, CertifiedRegionsRoundTrip) {
  const Groups groups = test::small_certified_groups(test::grid_tin(4, 3));
  const Bytes bytes = groups_writer(groups).to_bytes();
  const Groups back = read_groups(SectionFile::from_memory(bytes, "f"));
  ASSERT_TRUE(back.has_certified());
  EXPECT_EQ(back.certified.layout, groups.certified.layout);
  EXPECT_EQ(back.certified.steps, groups.certified.steps);
  for (std::size_t g = 0; g < 2; ++g) {
    const CertifiedGroup &read = back.certified.groups[g], &wrote = groups.certified.groups[g];
    EXPECT_EQ(read.centre_x_m, wrote.centre_x_m);
    EXPECT_EQ(read.centre_y_m, wrote.centre_y_m);
    EXPECT_EQ(read.height_m, wrote.height_m);
    EXPECT_EQ(read.radius_m, wrote.radius_m);
    EXPECT_EQ(read.low_slope, wrote.low_slope);
    EXPECT_EQ(read.slope_step, wrote.slope_step);
  }
  EXPECT_EQ(groups_writer(back).to_bytes(), bytes);
  // A scene without them has none of their sections.
  EXPECT_FALSE(SectionFile::from_memory(
                   groups_writer(test::small_groups(test::grid_tin(4, 3))).to_bytes(), "f")
                   .has("cert_layout"));
}

TEST(GroupsFile, AnyCertifiedStepsComeBack) {
  SplitMix64 random(3);
  Groups groups = test::small_certified_groups(test::grid_tin(4, 3));
  for (int trial = 0; trial < 200; ++trial) {
    for (SectorSteps& steps : groups.certified.steps) {
      const std::uint32_t most = random.below(3) == 0 ? 65'536 : 9'000;
      for (std::uint16_t& step : steps) step = static_cast<std::uint16_t>(random.below(most));
      // Steps may repeat anywhere, and more than one begin with the same ring.
      if (random.below(2) == 0) steps[3] = steps[4] = steps[5];
      if (random.below(2) == 0) steps[6] = steps[7] = 65'535;
      std::sort(steps.begin(), steps.end());
    }
    const Bytes bytes = groups_writer(groups).to_bytes();
    const Groups back = read_groups(SectionFile::from_memory(bytes, "f"));
    ASSERT_EQ(back.certified.steps, groups.certified.steps) << trial;
  }
}

TEST(GroupsFile, KeptBytesAreThoseOfTheSections) {
  Groups groups = test::small_certified_groups(test::grid_tin(4, 3));
  const std::size_t with = groups_writer(groups).to_bytes().size();
  const std::size_t kept = kept_bytes(groups.certified);
  groups.certified = {};
  const std::size_t without = groups_writer(groups).to_bytes().size();
  EXPECT_GT(kept, 0U);
  EXPECT_LT(kept, with - without);
  EXPECT_GT(kept + 512, with - without);  // the table's entries, and sections begin at multiples
}

TEST(GroupsFile, RefusesCertifiedRegionsThatCannotBeAsked) {
  const auto complains = [](const std::string& part,
                            const std::function<void(CertifiedRegions&)>& damage) {
    Groups groups = test::small_certified_groups(test::grid_tin(3, 3));
    damage(groups.certified);
    const std::string text = complaint(groups_writer(groups).to_bytes(), read_groups);
    EXPECT_NE(text.find(part), std::string::npos) << part << " | " << text;
  };
  complains("sectors are not a multiple of 8", [](CertifiedRegions& r) { r.layout.sectors = 4; });
  complains("ring bits", [](CertifiedRegions& r) { r.layout.ring_bits = 4; });
  complains("in a certified sector where", [](CertifiedRegions& r) { r.steps.pop_back(); });
  complains("no proper circle", [](CertifiedRegions& r) { r.groups[1].radius_m = 0; });
  complains("no proper circle", [](CertifiedRegions& r) { r.groups[0].low_slope = NAN; });
  complains("no proper circle", [](CertifiedRegions& r) { r.groups[0].slope_step = -1; });
  complains("no proper circle", [](CertifiedRegions& r) { r.groups[0].height_m = INFINITY; });
  complains("rings of group 1", [](CertifiedRegions& r) {
    r.steps[9] = {5 << kSlopeBits, 4 << kSlopeBits, 0, 0};
  });
  complains("group 0 is centred beyond",
            [](CertifiedRegions& r) { r.groups[0].centre_x_m = 1e300; });
  complains("group 1 is centred beyond",
            [](CertifiedRegions& r) { r.groups[1].centre_y_m = -1e9; });
}

TEST(GroupsFile, RefusesWhatCannotBeWalked) {
  const auto complains = [](const std::string& part, const std::function<void(Groups&)>& damage) {
    Groups groups = test::small_groups(test::grid_tin(3, 3));
    damage(groups);
    const std::string text = complaint(groups_writer(groups).to_bytes(), read_groups);
    EXPECT_NE(text.find(part), std::string::npos) << part << " | " << text;
  };
  complains("4 leaves in a tree of 3", [](Groups& g) { g.leaf_count = 4; });
  complains("triangle 0 is in group 2 of 2", [](Groups& g) { g.group_of_triangle[0] = 2; });
  complains("node 2 has node 2 as a child", [](Groups& g) {
    g.nodes[2].children[1] = 2;
    g.nodes[1].parent = kNone;
  });
  complains("node 2 has one child twice", [](Groups& g) {
    g.nodes[2].children[1] = 0;
    g.nodes[1].parent = kNone;
  });
  complains("node 0 has node 1 as a child", [](Groups& g) { g.nodes[0].children[0] = 1; });
  complains("node 0 has node 1 as its parent", [](Groups& g) { g.nodes[0].parent = 1; });
  complains("node 2 does not name its child 0", [](Groups& g) {
    g.leaf_count = 2;
    g.nodes[2].children = {1, 1};
  });
  complains("node 2 has node 7 as its parent", [](Groups& g) { g.nodes[2].parent = 7; });
  complains("no proper circle", [](Groups& g) { g.nodes[1].radius_m = -1; });
  complains("region 3 begins before", [](Groups& g) { g.regions.first[3] = 0; });
  complains("region points where", [](Groups& g) { g.regions.points.pop_back(); });
  complains("is not a number",
            [](Groups& g) { g.regions.points[0].z_m = std::numeric_limits<double>::quiet_NaN(); });
}

}  // namespace
}  // namespace scarp
