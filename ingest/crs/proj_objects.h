#pragma once

#include <proj.h>

#include <memory>
#include <string>

/// What all users of PROJ share. Objects belong to the thread that made them.
namespace scarp {

struct DestroyPj {
  void operator()(PJ* pj) const { proj_destroy(pj); }
};
struct DestroyContext {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
using PjPtr = std::unique_ptr<PJ, DestroyPj>;
using ContextPtr = std::unique_ptr<PJ_CONTEXT, DestroyContext>;

/// Without messages and without network.
ContextPtr make_proj_context();

/// The horizontal part of a CRS, without a bound transformation to another datum; null where the
/// text is no CRS.
PjPtr horizontal_crs(PJ_CONTEXT* context, const std::string& crs);

}  // namespace scarp
