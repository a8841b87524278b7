#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// What of a TIN can stand in the way of lines from one eye, by direction and distance: answers for
/// most targets whether edges of the mesh block them without going along the line.
///
/// The plane around the eye is four wedges, in each of which straight lines stay straight in
/// (tangent of the direction, rise for each metre ahead), and so is one over the distance ahead.
/// In narrow bins of the tangent the edges are kept that no nearer edge rises above: what a
/// target rises above is all under its line, and where it does not, the highest edge before it is
/// asked exactly.
///
/// Side: never wrong. Bounds are computed in double, with kRounding to spare; what they leave open
/// is for the judge.
/// Keeps references. Immutable after construction; the same for any number of threads.
/// Memory: 24 bytes for each edge kept, some ten to thirty in a bin.
class TinHorizon {
 public:
  enum class Answer {
    kFree,     ///< no edge or vertex is strictly above the line
    kBlocked,  ///< one is
    kOpen,
  };
  struct Found {
    Answer answer = Answer::kOpen;
    bool may_meet_border = true;  ///< the line, in plan; false only where it surely does not
  };

  /// @param outline    places around all targets; others may be answered kOpen
  /// @param spacing_m  between targets, about
  /// Cost: each edge within reach once for every bin that it passes over, on all threads.
  TinHorizon(const TinIndex& index, const Position& eye, const std::vector<Position>& outline,
             double spacing_m);

  /// Whether edges block the open segment from the eye to a target. Requires a lattice position.
  /// Cost: about a tenth of a microsecond.
  Found ask(const Position& target) const;

 private:
  static constexpr int kWedges = 4, kPartsInWedge = 16;

  /// A place as a wedge has it: metres ahead and aside, above the eye. Exact.
  struct Place {
    double ahead_m, aside_m, rise_m;
  };
  /// The same in perspective.
  struct Picture {
    double tangent, rise, nearness;  ///< nearness: one over the metres ahead
  };
  /// An edge in a bin; both are upper bounds there.
  struct Record {
    double nearness, rise;
    std::uint32_t edge;
  };
  /// Records by falling nearness, and rising rise: what is farther and lower is not kept.
  struct Bin {
    std::vector<Record> records;
    double nearest_border = 0;  ///< nearness
  };
  /// A part of a wedge: bins [first, end).
  struct Part {
    int wedge, first, end;
  };

  /// A part while it is filled.
  struct Filling {
    explicit Filling(const Part& of_bins);
    bool is_new(std::uint32_t edge);

    static constexpr std::uint32_t kRemembered = 8192;
    Part part;
    std::vector<Record> last;         // of each bin: the highest
    std::vector<std::uint32_t> seen;  // edges that came lately
  };

  static int wedge_of(double dx_m, double dy_m);
  Place place(int wedge, const Position& p) const;
  static Picture picture(const Place& p);
  double border(int bin) const { return bin * (2.0 / bins_in_wedge_) - 1; }
  int bin_of(double tangent) const;
  Part part_of(int number) const;
  Bin& bin(int wedge, int i) { return bins_[static_cast<std::size_t>(wedge * bins_in_wedge_ + i)]; }

  void choose_parts(const std::vector<Position>& outline);
  void measure_near_ground();
  void fill(const Part& part);
  void add(Filling& filling, std::uint32_t edge);
  static void keep(std::vector<Record>& records, const Record& record);

  const TinIndex& index_;
  Position eye_;
  double reach_m_ = 0;    // ahead
  double near_rise_ = 0;  // bound of all ground nearer than kNearM
  bool has_near_border_ = false;
  int bins_in_wedge_ = 0;
  std::array<bool, kWedges * kPartsInWedge> is_filled_{};
  std::vector<Bin> bins_;
};

}  // namespace scarp
