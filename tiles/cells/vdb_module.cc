// OpenVDB, loaded by vdb_file.cc when it is asked for: with all that it needs it takes the program
// longer to start than all else, and few ever want it.
#include "tiles/cells/vdb_module.h"

#include <openvdb/openvdb.h>

#include <cassert>

namespace scarp {
namespace {

std::size_t index_of(const VdbShape& shape, std::int32_t i, std::int32_t j, std::int32_t k) {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(shape.rows) +
          static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(shape.columns) +
         static_cast<std::size_t>(i);
}

template <class Grid, class Value>
typename Grid::Ptr grid_of(const VdbGrid<Value>& source,
                           const std::map<std::string, std::string>& metadata,
                           VdbSummary& summary) {
  const VdbShape& shape = source.shape;
  assert(source.values.size() == index_of(shape, 0, 0, shape.layers));
  assert(source.is_active.size() == source.values.size());
  auto grid = Grid::create(source.background);
  grid->setName(source.name);
  openvdb::math::Mat4d map = openvdb::math::Mat4d::identity();
  for (int axis = 0; axis < 3; ++axis) {
    map(axis, axis) = shape.cell[axis];
    map(3, axis) = shape.low[axis] + shape.cell[axis] / 2;
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(map));
  auto access = grid->getAccessor();
  for (std::int32_t k = 0; k < shape.layers; ++k)
    for (std::int32_t j = 0; j < shape.rows; ++j)
      for (std::int32_t i = 0; i < shape.columns; ++i) {
        const std::size_t at = index_of(shape, i, j, k);
        if (source.is_active[at] != 0) access.setValueOn({i, j, k}, source.values[at]);
      }
  grid->pruneGrid();
  for (const auto& [name, value] : metadata) grid->insertMeta(name, openvdb::StringMetadata(value));
  summary.active_cells += grid->activeVoxelCount();
  summary.leaves += grid->tree().leafCount();
  summary.tiles += grid->tree().activeTileCount();
  return grid;
}

std::string write(const std::string& path, const VdbFile& file, VdbSummary& summary) {
  openvdb::initialize();
  try {
    openvdb::GridPtrVec grids;
    for (const auto& grid : file.integers)
      grids.push_back(grid_of<openvdb::Int32Grid>(grid, file.metadata, summary));
    for (const auto& grid : file.floats)
      grids.push_back(grid_of<openvdb::FloatGrid>(grid, file.metadata, summary));
    openvdb::MetaMap metadata;
    for (const auto& [name, value] : file.metadata)
      metadata.insertMeta(name, openvdb::StringMetadata(value));
    openvdb::io::File output(path);
    output.write(grids, metadata);
    output.close();
  } catch (const openvdb::Exception& error) {
    return error.what();
  }
  return {};
}

std::string read(const std::string& path, const VdbFile& shapes, VdbFile& file) {
  openvdb::initialize();
  openvdb::io::File input(path);
  try {
    input.open();
    const auto metadata = input.getMetadata();
    for (auto entry = metadata->beginMeta(); entry != metadata->endMeta(); ++entry)
      file.metadata[entry->first] = entry->second->str();
    const auto read_grid = [&](const auto& shape, auto tag, auto& into) {
      using Grid = typename decltype(tag)::element_type;
      const auto grid = openvdb::gridPtrCast<Grid>(input.readGrid(shape.name));
      auto made = shape;
      made.background = grid->background();
      const VdbShape& s = made.shape;
      made.values.assign(index_of(s, 0, 0, s.layers), made.background);
      made.is_active.assign(made.values.size(), 0);
      const auto access = grid->getConstAccessor();
      for (std::int32_t k = 0; k < s.layers; ++k)
        for (std::int32_t j = 0; j < s.rows; ++j)
          for (std::int32_t i = 0; i < s.columns; ++i) {
            const std::size_t at = index_of(s, i, j, k);
            made.values[at] = access.getValue({i, j, k});
            made.is_active[at] = access.isValueOn({i, j, k});
          }
      into.push_back(std::move(made));
    };
    for (const auto& shape : shapes.integers)
      read_grid(shape, openvdb::Int32Grid::Ptr(), file.integers);
    for (const auto& shape : shapes.floats)
      read_grid(shape, openvdb::FloatGrid::Ptr(), file.floats);
  } catch (const openvdb::Exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace
}  // namespace scarp

extern "C" const scarp::VdbModule scarp_vdb_module = {SCARP_VERSION, scarp::write, scarp::read};
