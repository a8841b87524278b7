#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/serve/byte_cache.h"
#include "cli/serve/compute_pool.h"
#include "cli/serve/folder_files.h"
#include "cli/serve/http.h"
#include "cli/serve/http_server.h"
#include "cli/serve/jobs.h"
#include "cli/serve/map_tiles.h"
#include "cli/serve/metrics.h"
#include "cli/serve/process.h"
#include "cli/serve/request_target.h"
#include "cli/serve/seen_views.h"
#include "cli/serve/served_scenes.h"

namespace scarp {

/// A request on its way: what was understood of it so far.
struct Call {
  std::shared_ptr<const HttpRequest> request;
  RequestTarget target;
  std::map<std::string, std::string> path;  ///< parts of the path by the names of their route
  std::vector<std::string> rest;            ///< of a route that ends in {+rest}
  nlohmann::json query = nlohmann::json::object();
  std::string origin;  ///< for links, such as "http://localhost:8080"
};

/// One address of the server.
struct Route {
  std::string method;   ///< "GET" (HEAD with it), "POST", "DELETE"
  std::string pattern;  ///< such as "/scenes/{name}/tiles/{layer}/{z}/{x}/{y}.png"
  std::string id;       ///< operationId, and the name in metrics
  std::string summary;
  nlohmann::json parameters;  ///< of the query, by name: {"schema", "description", "required"}
  bool computes = false;      ///< on the pool; otherwise at once, on the connections' thread
  std::function<HttpResponse(Call&)> answer;
  std::string produces = "application/json";
};

/// What the server answers: the routes, what they need, and who computes. Routes are data, so that
/// /api says of each what it checks.
class Api {
 public:
  /// Opens all scenes. Throws what they throw.
  explicit Api(const ServeOptions& options);
  ~Api();

  /// A HttpHandler.
  void handle(std::shared_ptr<const HttpRequest> request, Reply reply);
  /// What waits for its turn is answered by 503, jobs are dismissed; what runs goes on.
  void close();
  /// After close() and once no request comes any more: waits for what runs. Its replies go to a
  /// server that must be there still.
  void finish();

  void watch(const HttpServer& server) { server_ = &server; }
  const ServedScenes& scenes() const { return *scenes_; }
  const std::vector<Route>& routes() const { return routes_; }
  const std::vector<Process>& processes() const { return processes_; }
  nlohmann::json openapi(const std::string& origin) const;
  bool has_page() const { return page_.has_value(); }

 private:
  void add(Route route);
  void add_general_routes();
  void add_scene_routes();
  void add_tile_routes();
  void add_process_routes();

  const Route* find(Call& call, bool& known_path) const;
  void check_query(const Route& route, Call& call) const;
  HttpResponse answer_now(const Route& route, Call& call, const StopAsked& stop);
  HttpResponse finished(HttpResponse response, const Call& call) const;
  std::optional<HttpResponse> refusal_of(const HttpRequest& request) const;

  nlohmann::json link(const Call& call, const char* rel, const std::string& path,
                      const char* type = "application/json") const;
  nlohmann::json scene_json(const Call& call, const ServedScene& scene) const;
  nlohmann::json collection_json(const Call& call, const ServedScene& scene) const;
  HttpResponse landing(Call& call) const;
  HttpResponse tile(Call& call, const std::string& layer, const MapTile& at);
  HttpResponse tile_json(Call& call) const;
  HttpResponse viewshed_of_query(Call& call);
  HttpResponse execute(Call& call);
  HttpResponse begin_job(Call& call, const Process& process, const nlohmann::json& inputs,
                         const std::string& format, bool as_document);
  HttpResponse run(const Process& process, const nlohmann::json& inputs, const std::string& format,
                   bool as_document, const Progress& progress, const std::string& origin);
  const Process& require_process(const std::string& id) const;
  HttpResponse metrics_text() const;

  const ServeOptions options_;
  const HttpServer* server_ = nullptr;
  std::unique_ptr<const ServedScenes> scenes_;
  std::map<std::string, std::unique_ptr<const FolderFiles>> files_;     // by scene
  std::map<std::string, std::unique_ptr<const FolderFiles>> tilesets_;  // by scene
  std::optional<FolderFiles> page_;
  std::vector<Process> processes_;
  std::vector<Route> routes_;
  SeenViews views_;
  struct StoredTile {
    std::string png, etag;
  };
  ByteCache<StoredTile> tiles_;
  Jobs jobs_;
  std::string version_;  ///< of all that tiles are made from
  mutable Metrics metrics_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::atomic<bool> closing_{false};
  // Last: their threads end before what they use goes.
  std::unique_ptr<ComputePool> pool_, job_pool_;
};

/// Where the page lies that the program was installed or built with; empty where there is none.
std::string installed_page();

}  // namespace scarp
