#pragma once

#include <functional>

#include "core/horizon/sectors.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A TIN over columns x rows points `step_m` apart from (0, 0) on, each cell cut from south-west
/// to north-east, with heights in metres by place. Row by row from the south.
Tin lattice_tin(int columns, int rows, double step_m,
                const std::function<double(double x_m, double y_m)>& height_m);

/// Horizon table straight from its definition: of every subsector the vertex with the greatest
/// slope, of these the lowest; kNone where a subsector is empty. Cost: O(vertices^2).
HorizonTable exhaustive_horizon(const Tin& tin, const SectorLayout& layout);

}  // namespace scarp
