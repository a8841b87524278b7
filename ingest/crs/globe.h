#pragma once

#include <memory>
#include <string>

#include "core/geodesy/flattening.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// Where positions of a scene lie on the globe: EPSG:4978, which engines and tiles use.
///
/// Data on WGS 84 are unflattened and nothing else. Others go through one transformation of datum,
/// the one that PROJ prefers at the scene's centre, for all of the scene: it moves the scene, and
/// cannot tear or bend it where PROJ would choose another one.
/// Accuracy: nanometres beside the transformation's own.
class Globe {
 public:
  /// Borrows the frame. Throws Error{kInput} where it is flat, or no transformation is known.
  explicit Globe(const GeoFrame& frame);

  /// What changed the datum, such as "NAD83 to WGS 84 (1)"; empty where nothing did.
  const std::string& datum_shift() const { return datum_shift_; }
  /// What PROJ says of its accuracy, metres; below 0 where it does not know.
  double datum_shift_accuracy_m() const { return datum_shift_accuracy_m_; }

  /// Does the work, one for each thread.
  class Placer {
   public:
    explicit Placer(const Globe& globe);
    ~Placer();
    Placer(Placer&&) noexcept;

    EcefPoint ecef(const Position& p) const;

   private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
  };

 private:
  const GeoFrame* frame_;
  std::string datum_shift_;
  double datum_shift_accuracy_m_ = 0;
};

}  // namespace scarp
