#include <fmt/format.h>

#include <fstream>

#include "cli/serve/api.h"
#include "cli/serve/negotiation.h"
#include "cli/serve/problem.h"

namespace scarp {
namespace {

using nlohmann::json;

/// What / says where the page is not installed.
constexpr char kNoPage[] =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Scarp</title>"
    "<h1>Scarp</h1><p>The server runs. Its page is left out: it was not built with the program "
    "(see docs/server.md).</p><ul><li><a href=\"/scenes\">Scenes</a></li>"
    "<li><a href=\"/api\">API</a></li><li><a href=\"/processes\">Processes</a></li></ul></html>\n";

std::uint64_t resident_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm").ignore(64, ' ') >> pages;
  constexpr std::uint64_t kPageBytes = 4096;
  return pages * kPageBytes;
}

}  // namespace

void Api::add_general_routes() {
  const json none = json::object();
  add({"GET", "/", "landing", "The page; for application/json the landing page of the API", none,
       false, [this](Call& call) { return landing(call); }, "text/html"});
  add({"GET", "/assets/{+rest}", "asset", "Files of the page", none, false,
       [this](Call& call) {
         if (!page_) return problem(404, "the page is not installed");
         std::vector<std::string> path = {"assets"};
         path.insert(path.end(), call.rest.begin(), call.rest.end());
         return page_->respond(*call.request, path);
       },
       "application/octet-stream"});
  for (const char* name : {"favicon.ico", "favicon.svg"})
    add({"GET", std::string("/") + name, name, "The page's icon", none, false,
         [this, name](Call& call) {
           if (!page_) return problem(404, "the page is not installed");
           return page_->respond(*call.request, {name});
         },
         "image/svg+xml"});
  add({"GET", "/health", "health", "Whether the server answers, and for how long", none, false,
       [this](Call&) {
         HttpResponse response = json_response(
             {{"status", closing_ ? "stopping" : "ok"},
              {"version", SCARP_VERSION},
              {"scenes", scenes_->all().size()},
              {"page", page_.has_value()},
              {"uptime_s",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count()}});
         response.set("Cache-Control", "no-store");
         return response;
       }});
  add({"GET", "/metrics", "metrics", "Counts and times, as Prometheus reads them", none, false,
       [this](Call&) { return metrics_text(); }, "text/plain"});
  add({"GET", "/api", "api", "This description, OpenAPI 3.0", none, false, [this](Call& call) {
         return json_response(openapi(call.origin), 200,
                              "application/vnd.oai.openapi+json;version=3.0");
       }});
  add({"GET", "/conformance", "conformance", "Classes of the OGC's standards that are met", none,
       false, [](Call&) {
         const std::string processes = "http://www.opengis.net/spec/ogcapi-processes-1/1.0/conf/";
         return json_response(
             {{"conformsTo",
               {processes + "core", processes + "ogc-process-description", processes + "json",
                processes + "oas30", processes + "job-list", processes + "dismiss"}}});
       }});
}

HttpResponse Api::landing(Call& call) const {
  static const std::vector<std::string> kOffers = {"text/html", "application/json"};
  const auto chosen = choose_media_type(call.request->header("accept"), kOffers);
  HttpResponse response;
  if (chosen == 1U) {
    response = json_response(
        {{"title", "Scarp"},
         {"description", "What can be seen from where, on terrain"},
         {"links",
          {link(call, "self", "/"),
           link(call, "service-desc", "/api", "application/vnd.oai.openapi+json;version=3.0"),
           link(call, "http://www.opengis.net/def/rel/ogc/1.0/conformance", "/conformance"),
           link(call, "http://www.opengis.net/def/rel/ogc/1.0/processes", "/processes"),
           link(call, "http://www.opengis.net/def/rel/ogc/1.0/job-list", "/jobs"),
           link(call, "data", "/scenes"), link(call, "alternate", "/", "text/html")}}});
  } else if (page_) {
    response = page_->respond(*call.request, {"index.html"});
    // Nothing from elsewhere runs in the page, and nothing of it goes elsewhere. Map libraries make
    // their workers and pictures from blobs.
    response.set(
        "Content-Security-Policy",
        "default-src 'self'; img-src 'self' data: blob:; worker-src 'self' blob:; "
        "child-src blob:; style-src 'self' 'unsafe-inline'; connect-src 'self' blob: data:; "
        "object-src 'none'; base-uri 'none'; frame-ancestors 'none'");
  } else {
    response = text_response(200, "text/html; charset=utf-8", kNoPage);
  }
  response.set("Vary", "Accept");
  return response;
}

HttpResponse Api::metrics_text() const {
  std::string text = metrics_.text();
  const auto gauge = [&](const char* name, const char* help, double value) {
    text += Metrics::line(name, "gauge", help, value);
  };
  const auto counter = [&](const char* name, const char* help, double value) {
    text += Metrics::line(name, "counter", help, value);
  };
  if (server_) {
    const HttpCounts counts = server_->counts();
    gauge("scarp_open_connections", "Connections that are open.",
          static_cast<double>(counts.open_connections));
    counter("scarp_connections_total", "Connections so far.",
            static_cast<double>(counts.accepted_connections));
    counter("scarp_requests_total", "Requests so far.", static_cast<double>(counts.requests));
  }
  const ComputePool::Counts pool = pool_->counts(), job_pool = job_pool_->counts();
  gauge("scarp_waiting_tasks", "Requests that wait for a thread.",
        static_cast<double>(pool.waiting));
  gauge("scarp_running_tasks", "Requests that are computed.", static_cast<double>(pool.running));
  counter("scarp_refused_tasks_total", "Requests refused because too many waited.",
          static_cast<double>(pool.refused));
  gauge("scarp_jobs_under_way", "Jobs that wait or run.",
        static_cast<double>(job_pool.waiting + job_pool.running));
  const auto cache = [&](const std::string& name, std::size_t bytes, std::uint64_t hits,
                         std::uint64_t misses) {
    text += Metrics::line("scarp_" + name + "_cache_bytes", "gauge", "Bytes that are kept.",
                          static_cast<double>(bytes));
    text += Metrics::line("scarp_" + name + "_cache_hits_total", "counter", "Found there.",
                          static_cast<double>(hits));
    text += Metrics::line("scarp_" + name + "_cache_misses_total", "counter", "Not found there.",
                          static_cast<double>(misses));
  };
  const auto tiles = tiles_.counts();
  cache("tile", tiles.bytes, tiles.hits, tiles.misses);
  const auto views = views_.counts();
  cache("viewshed", views.bytes, views.hits, views.misses);
  gauge("process_resident_memory_bytes", "Memory that the process has.",
        static_cast<double>(resident_bytes()));
  HttpResponse response = text_response(200, "text/plain; version=0.0.4", text);
  response.set("Cache-Control", "no-store");
  return response;
}

}  // namespace scarp
