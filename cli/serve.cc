#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/serve/api.h"
#include "cli/serve/http_server.h"

namespace scarp {
namespace {

void print_begun(const ServeOptions& options, const Api& api, const HttpServer& server) {
  const bool is_six = options.host.find(':') != std::string::npos;
  const std::string address = fmt::format("http://{}{}{}:{}/", is_six ? "[" : "", options.host,
                                          is_six ? "]" : "", server.port());
  if (options.common.json) {
    fmt::print("{}\n", nlohmann::json({{"address", address},
                                       {"port", server.port()},
                                       {"page", api.has_page()},
                                       {"scenes", api.scenes().names()}})
                           .dump());
  } else {
    fmt::print("{} shows {}\n", address, fmt::join(api.scenes().names(), ", "));
    if (!api.has_page())
      fmt::print("The page is left out: it was not built with the program. The API is there.\n");
    if (!server.is_loopback())
      fmt::print("Everybody who reaches this machine may ask: there is no password.\n");
  }
  std::fflush(stdout);
}

}  // namespace

int run_serve(const ServeOptions& options) {
  Api api(options);
  HttpServer server(options.host, static_cast<std::uint16_t>(options.port), HttpLimits(),
                    [&api](std::shared_ptr<const HttpRequest> request, Reply reply) {
                      api.handle(std::move(request), std::move(reply));
                    });
  api.watch(server);
  const std::chrono::milliseconds patience(static_cast<std::int64_t>(1000 * options.limits.time_s) +
                                           1000);
  server.stop_on_signals(patience, [&api] { api.close(); });
  print_begun(options, api, server);
  server.run();
  api.finish();
  return 0;
}

}  // namespace scarp
