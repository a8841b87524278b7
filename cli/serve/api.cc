#include "cli/serve/api.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <span>
#include <string_view>

#include "cli/serve/json_schema.h"
#include "cli/serve/negotiation.h"
#include "cli/serve/problem.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "tiles/store/checksum.h"

namespace scarp {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

/// "{name}" as "name", with what comes after it; nothing of a plain segment.
struct Placeholder {
  std::string name, ending;
};
std::optional<Placeholder> placeholder_of(const std::string& segment) {
  if (segment.empty() || segment.front() != '{') return {};
  const std::size_t end = segment.find('}');
  return Placeholder{segment.substr(1, end - 1), segment.substr(end + 1)};
}

std::vector<std::string> segments_of(const std::string& pattern) {
  std::vector<std::string> segments;
  for (std::size_t begin = 1; begin < pattern.size();) {
    const std::size_t end = std::min(pattern.find('/', begin), pattern.size());
    segments.push_back(pattern.substr(begin, end - begin));
    begin = end + 1;
  }
  return segments;
}

bool matches(const Route& route, Call& call) {
  const std::vector<std::string> pattern = segments_of(route.pattern);
  const std::vector<std::string>& given = call.target.segments;
  const bool takes_rest = !pattern.empty() && pattern.back() == "{+rest}";
  if (takes_rest ? given.size() < pattern.size() : given.size() != pattern.size()) return false;
  std::map<std::string, std::string> path;
  for (std::size_t i = 0; i < pattern.size() - (takes_rest ? 1 : 0); ++i) {
    const auto placeholder = placeholder_of(pattern[i]);
    if (!placeholder) {
      if (given[i] != pattern[i]) return false;
      continue;
    }
    const std::string& ending = placeholder->ending;
    if (!given[i].ends_with(ending) || given[i].size() == ending.size()) return false;
    path[placeholder->name] = given[i].substr(0, given[i].size() - ending.size());
  }
  call.path = std::move(path);
  call.rest.clear();
  if (takes_rest)
    call.rest.assign(given.begin() + static_cast<std::ptrdiff_t>(pattern.size()) - 1, given.end());
  return true;
}

/// A host that links may name: a name or an address, and a port.
bool is_host(std::string_view host) {
  constexpr std::size_t kLongest = 255;
  return !host.empty() && host.size() <= kLongest &&
         std::all_of(host.begin(), host.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '.' || c == '-' || c == ':' || c == '[' || c == ']';
         });
}

std::string_view without_port(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

bool is_this_machine(std::string_view host) {
  const std::string_view name = without_port(host);
  // Digits and points only: "127.elsewhere.example" is a name like any other.
  const bool is_number = name.find_first_not_of("0123456789.") == std::string_view::npos;
  return name == "localhost" || name == "[::1]" || (is_number && name.starts_with("127."));
}

bool is_loopback_host(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

}  // namespace

Api::Api(const ServeOptions& options)
    : options_(options),
      scenes_(std::make_unique<const ServedScenes>(options.sources, options.dem)),
      views_(static_cast<std::size_t>(options.limits.cache_bytes / 2), options_.limits),
      tiles_(static_cast<std::size_t>(options.limits.cache_bytes / 2)),
      jobs_(options.limits.jobs, options.limits.running_jobs,
            static_cast<std::size_t>(options.limits.cache_bytes)) {
  std::string all;
  for (const auto& scene : scenes_->all()) {
    if (scene->is_scene())
      files_[scene->name()] = std::make_unique<const FolderFiles>(scene->path());
    all += scene->description().dump();
  }
  version_ = to_hex(checksum_of(std::as_bytes(std::span(all)))).substr(0, 12);
  for (const std::string& text : options.tilesets) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos || !scenes_->find(name))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--tileset {}: NAME=FOLDER was expected, NAME one of {}", text,
                              fmt::join(scenes_->names(), ", ")));
    tilesets_[name] = std::make_unique<const FolderFiles>(text.substr(equals + 1));
  }
  const std::string page = options.page_folder.empty() ? installed_page() : options.page_folder;
  if (!page.empty()) page_.emplace(page);
  processes_ = all_processes(*scenes_, options_.limits);
  add_general_routes();
  add_scene_routes();
  add_tile_routes();
  add_process_routes();
  ComputePool::Limits pool;
  pool.threads = std::max(2, thread_count());
  pool.waiting = options.limits.waiting;
  pool.waiting_of_client = options.limits.waiting_of_client;
  pool_ = std::make_unique<ComputePool>(pool);
  // Long work has a thread of its own, so that it never keeps short work waiting.
  pool.threads = 1;
  pool.waiting = pool.waiting_of_client = options.limits.running_jobs;
  job_pool_ = std::make_unique<ComputePool>(pool);
}

Api::~Api() {
  finish();
}

void Api::close() {
  closing_ = true;
  for (const auto& job : jobs_.all()) job->dismiss();
  if (pool_) pool_->close();
  if (job_pool_) job_pool_->close();
}

void Api::finish() {
  close();
  pool_.reset();
  job_pool_.reset();
}

void Api::add(Route route) {
  routes_.push_back(std::move(route));
}

const Route* Api::find(Call& call, bool& known_path) const {
  const std::string& asked = call.request->method;
  for (const Route& route : routes_) {
    if (!matches(route, call)) continue;
    known_path = true;
    if (route.method == asked || (route.method == "GET" && asked == "HEAD")) return &route;
  }
  return nullptr;
}

void Api::check_query(const Route& route, Call& call) const {
  for (const auto& [name, text] : call.target.query) {
    if (!route.parameters.contains(name)) {
      std::string known;
      for (const auto& parameter : route.parameters.items())
        known += (known.empty() ? "" : ", ") + parameter.key();
      throw Refusal(400, fmt::format("query: '{}' is not known; known are: {}", name,
                                     known.empty() ? "none" : known));
    }
    const json& parameter = route.parameters[name];
    const json& schema = parameter["schema"];
    if (parameter.value("explode", false)) {
      if (!call.query.contains(name)) call.query[name] = json::array();
      call.query[name].push_back(value_of_text(schema["items"], text));
    } else if (call.query.contains(name)) {
      throw Refusal(400, fmt::format("query: '{}' is given twice", name));
    } else {
      call.query[name] = value_of_text(schema, text);
    }
  }
  for (const auto& parameter : route.parameters.items()) {
    const std::string& name = parameter.key();
    if (!call.query.contains(name)) {
      if (parameter.value().value("required", false))
        throw Refusal(400, fmt::format("query: '{}' is missing: {}", name,
                                       parameter.value().value("description", "")));
      continue;
    }
    if (const auto fault =
            schema_fault(parameter.value()["schema"], call.query[name], "query." + name))
      throw Refusal(400, *fault);
  }
}

/// What is refused before anybody looks at the address.
std::optional<HttpResponse> Api::refusal_of(const HttpRequest& request) const {
  const std::string_view host = request.header("host");
  // A page from elsewhere whose name was made to point here must not be answered.
  if (is_loopback_host(options_.host) && !host.empty() && !is_this_machine(host))
    return problem(421, "this server answers to localhost only; serve with --host to open it");
  if (request.method == "GET" || request.method == "HEAD") return {};
  const std::string_view origin = request.header("origin");
  if (!origin.empty() && origin != options_.cors_origin && options_.cors_origin != "*") {
    const std::size_t scheme = origin.find("://");
    const bool is_own =
        scheme != std::string_view::npos && origin.substr(scheme + 3) == request.header("host");
    if (!is_own)
      return problem(403,
                     "pages from elsewhere may not ask for work; serve with --cors ORIGIN to "
                     "let one");
  }
  return {};
}

HttpResponse Api::answer_now(const Route& route, Call& call, const StopAsked& stop) {
  try {
    const StopScope scope(stop);
    return route.answer(call);
  } catch (const std::exception& error) {
    return problem_of(error);
  }
}

HttpResponse Api::finished(HttpResponse response, const Call& call) const {
  if (!options_.cors_origin.empty()) {
    response.set("Access-Control-Allow-Origin", options_.cors_origin);
    response.set("Access-Control-Expose-Headers",
                 "X-Scarp-Bounds, X-Scarp-Visible-Cells, X-Scarp-Known-Cells, Server-Timing, "
                 "Location, ETag");
    response.set("Vary", "Origin");
  }
  const std::string_view wanted = call.request->header("if-none-match");
  if (response.status == 200 && !wanted.empty())
    for (const auto& [name, value] : response.headers)
      if (name == "ETag" && matches_etag(wanted, value)) {
        response.status = 304;
        response.body.reset();
        break;
      }
  return response;
}

void Api::handle(std::shared_ptr<const HttpRequest> request, Reply reply) {
  const auto begun = Clock::now();
  const auto call = std::make_shared<Call>();
  call->request = request;
  const auto done = [this, call, reply, begun](const std::string& route, HttpResponse response) {
    response = finished(std::move(response), *call);
    metrics_.count(route, response.status,
                   std::chrono::duration<double>(Clock::now() - begun).count());
    reply(std::move(response));
  };
  if (const auto refusal = refusal_of(*request)) return done("refused", *refusal);
  const auto target = parse_target(request->target);
  if (!target)
    return done("refused", problem(400,
                                   "the address is not understood; a path such as /scenes "
                                   "was expected, without . and .. and broken escapes"));
  call->target = *target;
  const std::string_view host = request->header("host");
  if (is_host(host)) call->origin = "http://" + std::string(host);
  bool known_path = false;
  const Route* route = find(*call, known_path);
  if (!route && request->method == "OPTIONS" && known_path) {
    HttpResponse response;
    response.status = 204;
    response.set("Allow", "GET, HEAD, POST, DELETE, OPTIONS");
    response.set("Access-Control-Allow-Methods", "GET, HEAD, POST, DELETE");
    response.set("Access-Control-Allow-Headers", "Content-Type, Accept, Prefer");
    return done("options", response);
  }
  if (!route && known_path) {
    HttpResponse response =
        problem(405, fmt::format("{}: is not for this address", request->method.substr(0, 20)));
    response.set("Allow", "GET, HEAD, POST, DELETE, OPTIONS");
    return done("refused", response);
  }
  if (!route) return done("refused", problem(404, "there is nothing at this address"));
  try {
    check_query(*route, *call);
  } catch (const std::exception& error) {
    return done(route->id, problem_of(error));
  }
  if (!route->computes) return done(route->id, answer_now(*route, *call, {}));
  const auto end = begun + std::chrono::duration_cast<Clock::duration>(
                               std::chrono::duration<double>(options_.limits.time_s));
  const StopAsked stop = [left = request->left, end] { return *left || Clock::now() > end; };
  PoolTask task;
  task.client = request->client;
  task.is_not_wanted = stop;
  task.run = [this, route, call, done, stop] { done(route->id, answer_now(*route, *call, stop)); };
  task.refuse = [done, route](PoolTask::Why why) {
    done(route->id, problem(503, why == PoolTask::Why::kClosing
                                     ? "the server is stopping; ask again later"
                                     : "its turn did not come in time; ask again later"));
  };
  if (pool_->submit(std::move(task))) return;
  done(route->id,
       closing_ ? problem(503, "the server is stopping; ask again later")
                : problem(429, "too much is asked for at once; ask again when something is done"));
}

json Api::link(const Call& call, const char* rel, const std::string& path, const char* type) const {
  return {{"rel", rel}, {"type", type}, {"href", call.origin + path}};
}

std::string installed_page() {
  std::error_code failure;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failure);
  if (failure) return {};
  for (const char* place : {"web", "../share/scarp/web"}) {
    const std::filesystem::path folder = program.parent_path() / place;
    if (std::filesystem::exists(folder / "index.html", failure)) return folder.string();
  }
  return {};
}

}  // namespace scarp
