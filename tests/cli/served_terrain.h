#pragma once

#include <memory>
#include <string>
#include <thread>

#include "cli/serve/api.h"
#include "cli/serve/http_server.h"
#include "tests/support/http_client.h"
#include "tests/support/temp_folder.h"

namespace scarp::test {

/// Two small sources for servers, made once: "alps", a DEM of 140 x 120 cells of 100 m near 8.65 E
/// 46.55 N with a hole, and "valley", a scene built from it.
class ServedTerrain {
 public:
  static const ServedTerrain& get();

  std::string dem() const { return folder_.path("alps.tif"); }
  std::string scene() const { return folder_.path("valley.scene"); }
  std::string path(const std::string& name) const { return folder_.path(name); }

 private:
  ServedTerrain();
  TempFolder folder_;
};

/// A place on its ground, and another one 4 km from it.
inline constexpr char kEyePlace[] = "8.65,46.55";
inline constexpr char kTargetPlace[] = "8.69,46.57";

/// A server in this process, on a port that was free.
class TestServer {
 public:
  explicit TestServer(ServeOptions options = served(), HttpLimits limits = {});
  ~TestServer();

  /// Of both sources.
  static ServeOptions served();

  std::uint16_t port() const { return server_->port(); }
  HttpServer& server() { return *server_; }
  Api& api() { return *api_; }
  HttpAnswer get(const std::string& target, const std::string& headers = "") const {
    return HttpConnection(port()).get(target, headers);
  }
  HttpAnswer post(const std::string& target, const std::string& body,
                  const std::string& headers = "") const {
    return HttpConnection(port()).post(target, body, headers);
  }

 private:
  std::unique_ptr<Api> api_;
  std::unique_ptr<HttpServer> server_;
  std::thread thread_;
};

}  // namespace scarp::test
