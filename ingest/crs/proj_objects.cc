#include "ingest/crs/proj_objects.h"

namespace scarp {

ContextPtr make_proj_context() {
  ContextPtr context(proj_context_create());
  proj_log_level(context.get(), PJ_LOG_NONE);
  proj_context_set_enable_network(context.get(), 0);
  return context;
}

PjPtr horizontal_crs(PJ_CONTEXT* context, const std::string& crs) {
  PjPtr pj(proj_create(context, crs.c_str()));
  while (pj) {
    const PJ_TYPE type = proj_get_type(pj.get());
    if (type == PJ_TYPE_BOUND_CRS)
      pj.reset(proj_get_source_crs(context, pj.get()));
    else if (type == PJ_TYPE_COMPOUND_CRS)
      pj.reset(proj_crs_get_sub_crs(context, pj.get(), 0));
    else
      break;
  }
  return pj;
}

}  // namespace scarp
