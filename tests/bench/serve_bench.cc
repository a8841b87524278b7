// The server from outside: what a click costs, and how it stands a load.
//   scripts/bench serve [--side 2048] [--clicks 60] [--dem FILE]
//       viewsheds of 15 km from random places on ground of 30 m, one after the other, as pictures:
//       as the server measures them and as the client does; then as many as fit into some seconds.
//   scripts/prove load: serve_bench --load SECONDS [--idle 200] [--users 8] [--p99-ms 1000]
//                                   [--memory-mb 512]
//       users who ask for the next viewshed as soon as they have one, and idle connections that are
//       kept alive; ends with 1 where an answer is not 200, an idle connection is lost, the 99th
//       percentile is above, or the program's memory is above.
// Starts the program itself, so that the kernel counts its memory alone.
#include <fcntl.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/fractal_ground.h"
#include "tests/support/http_client.h"
#include "tests/support/temp_folder.h"

extern char** environ;

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;
using scarp::test::HttpAnswer;
using scarp::test::HttpConnection;

struct Options {
  int side = 2048, clicks = 60, idle = 200, users = 8;
  double load_s = 0, p99_ms = 0, memory_mb = 0;
  std::string dem;
};

void write_dem(const std::string& path, int side) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), side, side, 1, GDT_Int16, nullptr));
  if (!dataset) throw std::runtime_error("cannot write " + path);
  double transform[6] = {450'000, 30, 0, 5'200'000, 0, -30};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:32632");
  dataset->SetSpatialRef(&crs);
  const scarp::test::FractalGround ground(1);
  std::vector<std::int16_t> heights(static_cast<std::size_t>(side));
  for (int row = 0; row < side; ++row) {
    ground.row(0, row, heights);
    if (dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, row, side, 1, heights.data(), side, 1,
                                            GDT_Int16, 0, 0) != CE_None)
      throw std::runtime_error("cannot write " + path);
  }
}

/// The program as a child.
class Served {
 public:
  explicit Served(const std::string& dem) {
    const std::string out = folder_.path("out");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT, 0600);
    std::string words[] = {SCARP_PROGRAM, "serve", dem, "--port", "0", "--json"};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    if (posix_spawn(&process_, words[0].c_str(), &actions, nullptr, argv.data(), environ) != 0)
      throw std::runtime_error("cannot start " + words[0]);
    posix_spawn_file_actions_destroy(&actions);
    for (int i = 0; i < 600; ++i) {
      std::ostringstream text;
      text << std::ifstream(out).rdbuf();
      if (text.str().ends_with("\n")) {
        begun_ = json::parse(text.str());
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    throw std::runtime_error("the server does not begin");
  }
  ~Served() {
    if (process_ > 0) stop();
  }

  std::uint16_t port() const { return begun_["port"]; }
  std::string scene() const { return begun_["scenes"][0]; }
  double peak_mb() const {
    std::ifstream status("/proc/" + std::to_string(process_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
    return 0;
  }
  /// Time of processors so far, of all its threads: what others do on the machine does not count.
  double processor_ms() const {
    std::ifstream status("/proc/" + std::to_string(process_) + "/stat");
    std::string text;
    std::getline(status, text);
    std::istringstream fields(text.substr(text.rfind(')') + 2));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, system = 0;
    fields >> user >> system;
    return (user + system) * 1000 / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  /// Exit code.
  int stop() {
    ::kill(process_, SIGTERM);
    int status = 0;
    ::waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  scarp::test::TempFolder folder_;
  pid_t process_ = 0;
  json begun_;
};

/// Random eyes over a scene.
class Clicks {
 public:
  Clicks(const Served& served, std::uint64_t seed) : scene_(served.scene()), random_(seed) {
    const HttpAnswer answer = HttpConnection(served.port()).get("/scenes/" + scene_);
    bounds_ = json::parse(answer.body)["bounds"].get<std::vector<double>>();
  }
  std::string next() {
    std::uniform_real_distribution<double> part(0.3, 0.7);
    const double lon = bounds_[0] + part(random_) * (bounds_[2] - bounds_[0]);
    const double lat = bounds_[1] + part(random_) * (bounds_[3] - bounds_[1]);
    return json({{"inputs",
                  {{"scene", scene_},
                   {"observers", {fmt::format("{:.6f},{:.6f},10", lon, lat)}},
                   {"max_distance_m", 15'000}}}})
        .dump();
  }

 private:
  std::string scene_;
  std::vector<double> bounds_;
  std::mt19937_64 random_;
};

double ms_since(Clock::time_point begun) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

HttpAnswer click(HttpConnection& connection, const std::string& body) {
  return connection.post("/processes/viewshed/execution", body, "Accept: image/png\r\n");
}

int measure_clicks(const Served& served, const Options& options) {
  Clicks clicks(served, 1);
  HttpConnection connection(served.port());
  std::vector<double> trip_ms, see_ms, picture_ms, bytes;
  const double begun_processor_ms = served.processor_ms();
  for (int i = 0; i < options.clicks; ++i) {
    const std::string body = clicks.next();
    const auto begun = Clock::now();
    const HttpAnswer answer = click(connection, body);
    trip_ms.push_back(ms_since(begun));
    if (answer.status != 200) throw std::runtime_error(answer.body);
    double see = 0, picture = 0;
    std::sscanf(answer.headers.at("server-timing").c_str(), "see;dur=%lf, picture;dur=%lf", &see,
                &picture);
    see_ms.push_back(see);
    picture_ms.push_back(picture);
    bytes.push_back(static_cast<double>(answer.body.size()));
  }
  fmt::print("{} viewsheds of 15 km, milliseconds\n", options.clicks);
  fmt::print("first round trip {:.1f}\n", trip_ms.front());
  const auto line = [](const char* name, const std::vector<double>& values) {
    fmt::print("{:<12} median {:8.1f}  p95 {:8.1f}  most {:8.1f}\n", name, percentile(values, 0.5),
               percentile(values, 0.95), percentile(values, 1));
  };
  line("see", see_ms);
  line("picture", picture_ms);
  line("round trip", trip_ms);
  fmt::print("processors {:.1f} a viewshed; picture of {:.0f} bytes (median)\n",
             (served.processor_ms() - begun_processor_ms) / options.clicks, percentile(bytes, 0.5));
  constexpr double kDragMs = 5000;
  int dragged = 0;
  for (const auto begun = Clock::now(); ms_since(begun) < kDragMs; ++dragged)
    if (click(connection, clicks.next()).status != 200) return 1;
  fmt::print("dragging: {:.1f} a second\n", dragged / (kDragMs / 1000));
  fmt::print("memory at most {:.0f} MB\n", served.peak_mb());
  return 0;
}

/// Idle connections: each asks once in a while whether it is still there.
class IdleClients {
 public:
  IdleClients(std::uint16_t port, int count) {
    for (int i = 0; i < count; ++i) connections_.push_back(std::make_unique<HttpConnection>(port));
  }
  /// One of them asks; returns whether it was answered.
  bool ask_next() {
    HttpConnection& connection = *connections_[next_++ % connections_.size()];
    return connection.get("/health").status == 200;
  }
  std::size_t size() const { return connections_.size(); }

 private:
  std::vector<std::unique_ptr<HttpConnection>> connections_;
  std::size_t next_ = 0;
};

int bear_load(Served& served, const Options& options) {
  IdleClients idle(served.port(), options.idle);
  std::mutex mutex;
  std::vector<double> trip_ms;
  std::atomic<int> errors{0};
  std::atomic<bool> over{false};
  std::vector<std::thread> users;
  for (int user = 0; user < options.users; ++user) {
    users.emplace_back([&, user] {
      try {
        Clicks clicks(served, static_cast<std::uint64_t>(user) + 10);
        HttpConnection connection(served.port());
        while (!over) {
          const auto begun = Clock::now();
          const HttpAnswer answer = click(connection, clicks.next());
          const double took_ms = ms_since(begun);
          if (answer.status != 200 && errors++ < 5)
            fmt::print(stderr, "status {}: {}\n", answer.status, answer.body.substr(0, 200));
          const std::scoped_lock lock(mutex);
          trip_ms.push_back(took_ms);
        }
      } catch (const std::exception& error) {
        ++errors;
        fmt::print(stderr, "{}\n", error.what());
      }
    });
  }
  const auto begun = Clock::now();
  while (ms_since(begun) < options.load_s * 1000) {
    if (!idle.ask_next()) ++errors;
    // All of them have asked after half a minute.
    std::this_thread::sleep_for(
        std::chrono::milliseconds(30'000 / std::max<std::size_t>(1, idle.size())));
  }
  over = true;
  for (std::thread& user : users) user.join();
  for (std::size_t i = 0; i < idle.size(); ++i)
    if (!idle.ask_next()) ++errors;
  const double processor_ms = served.processor_ms() / static_cast<double>(trip_ms.size());
  const double p99_ms = percentile(trip_ms, 0.99), peak_mb = served.peak_mb();
  const int exit_code = served.stop();
  fmt::print(
      "{:.0f} s, {} idle connections, {} users: {} viewsheds, {:.1f} a second, {} errors\n"
      "round trip: median {:.0f} ms, p99 {:.0f} ms, most {:.0f} ms; processors {:.0f} ms a "
      "viewshed; memory at most {:.0f} MB; exit {}\n",
      options.load_s, options.idle, options.users, trip_ms.size(),
      static_cast<double>(trip_ms.size()) / options.load_s, errors.load(), percentile(trip_ms, 0.5),
      p99_ms, percentile(trip_ms, 1), processor_ms, peak_mb, exit_code);
  const bool slow = options.p99_ms > 0 && p99_ms > options.p99_ms;
  const bool large = options.memory_mb > 0 && peak_mb > options.memory_mb;
  return errors == 0 && exit_code == 0 && !trip_ms.empty() && !slow && !large ? 0 : 1;
}

Options options_from(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--side")
      options.side = std::stoi(value);
    else if (name == "--clicks")
      options.clicks = std::stoi(value);
    else if (name == "--idle")
      options.idle = std::stoi(value);
    else if (name == "--users")
      options.users = std::stoi(value);
    else if (name == "--load")
      options.load_s = std::stod(value);
    else if (name == "--p99-ms")
      options.p99_ms = std::stod(value);
    else if (name == "--memory-mb")
      options.memory_mb = std::stod(value);
    else if (name == "--dem")
      options.dem = value;
    else
      throw std::runtime_error("not known: " + name);
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = options_from(argc, argv);
    const scarp::test::TempFolder folder;
    std::string dem = options.dem;
    if (dem.empty()) {
      dem = folder.path("ground.tif");
      write_dem(dem, options.side);
    }
    Served served(dem);
    return options.load_s > 0 ? bear_load(served, options) : measure_clicks(served, options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "serve_bench: {}\n", error.what());
    return 1;
  }
}
