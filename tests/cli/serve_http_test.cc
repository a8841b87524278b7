#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/cli/served_terrain.h"

/// What comes over the wire: whatever it is, it gets an answer or a clean close.
namespace scarp {
namespace {

using nlohmann::json;
using test::HttpAnswer;
using test::HttpConnection;
using test::ServedTerrain;
using test::TestServer;

/// RFC 7807, and no more than is said there.
void expect_problem(const HttpAnswer& answer, int status) {
  EXPECT_EQ(answer.status, status) << answer.body;
  ASSERT_TRUE(answer.headers.contains("content-type"));
  EXPECT_EQ(answer.headers.at("content-type"), "application/problem+json");
  const json problem = json::parse(answer.body);
  EXPECT_EQ(problem["status"], status);
  EXPECT_TRUE(problem["type"].is_string());
  EXPECT_TRUE(problem["title"].is_string());
  EXPECT_GT(problem["detail"].get<std::string>().size(), 10U);
}

TEST(ServeHttp, OneConnectionServesManyRequests) {
  const TestServer server;
  HttpConnection connection(server.port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(connection.get("/health").status, 200);
  // Two at once, and then their answers in this order.
  ASSERT_TRUE(connection.send(
      "GET /health HTTP/1.1\r\nHost: localhost\r\n\r\nGET /nothing HTTP/1.1\r\nHost: "
      "localhost\r\n\r\n"));
  EXPECT_EQ(connection.receive().status, 200);
  EXPECT_EQ(connection.receive().status, 404);
  ASSERT_TRUE(connection.send("HEAD /scenes HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  const HttpAnswer head = connection.receive(true);
  EXPECT_EQ(head.status, 200);
  EXPECT_GT(std::stoi(head.headers.at("content-length")), 100);
  EXPECT_EQ(connection.get("/health", "Connection: close\r\n").status, 200);
  EXPECT_TRUE(connection.is_closed());
}

TEST(ServeHttp, SlowClientsGet408AndIdleOnesACleanClose) {
  HttpLimits limits;
  limits.header_time = limits.body_time = std::chrono::milliseconds(150);
  limits.idle_time = std::chrono::milliseconds(400);
  const TestServer server(TestServer::served(), limits);
  HttpConnection half(server.port());
  half.send("GET /health HT");
  expect_problem(half.receive(), 408);
  EXPECT_TRUE(half.is_closed());
  HttpConnection slow_body(server.port());
  slow_body.send(
      "POST /processes/echo/execution HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{");
  expect_problem(slow_body.receive(), 408);
  HttpConnection idle(server.port());
  EXPECT_TRUE(idle.is_closed());
  EXPECT_EQ(server.get("/health").status, 200);
}

TEST(ServeHttp, LimitsOfSizeHaveTheirStatus) {
  const TestServer server;
  expect_problem(server.get("/" + std::string(5000, 'a')), 414);
  expect_problem(server.get("/health", "X-Long: " + std::string(20'000, 'a') + "\r\n"), 431);
  expect_problem(server.post("/processes/echo/execution", std::string(2 << 20, ' ')), 413);
  // The length alone is enough, and nothing of a body is waited for.
  HttpConnection promise(server.port());
  promise.send(
      "POST /processes/echo/execution HTTP/1.1\r\nHost: localhost\r\nContent-Length: "
      "99999999999\r\n\r\n");
  expect_problem(promise.receive(), 413);
}

TEST(ServeHttp, AnythingGetsAnAnswerOrACleanClose) {
  HttpLimits limits;
  limits.header_time = limits.body_time = std::chrono::milliseconds(300);
  const TestServer server(TestServer::served(), limits);
  for (const std::string& bytes :
       {std::string("\r\n\r\n\r\n"), std::string("GET\r\n\r\n"), std::string("\0\0\0\0\r\n\r\n", 8),
        std::string("GET / HTTP/9.9\r\n\r\n"), std::string("GET / HTTP/1.1\r\nno colon\r\n\r\n"),
        std::string("POST /processes/echo/execution HTTP/1.1\r\nContent-Length: -1\r\n\r\n"),
        std::string("POST /x HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n"),
        std::string(
            "POST /x HTTP/1.1\r\nTransfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n0\r\n"
            "\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11) + "\r\n\r\n",
        std::string("GET http://elsewhere/ HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        std::string("OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        std::string("BREW /scenes HTTP/1.1\r\nHost: localhost\r\n\r\n")}) {
    HttpConnection connection(server.port());
    connection.send(bytes);
    const HttpAnswer answer = connection.receive();
    if (answer.status != 0) {
      EXPECT_GE(answer.status, 400) << bytes;
      EXPECT_LT(answer.status, 500) << bytes;
    }
  }
  // Broken off at every length.
  const std::string whole =
      "POST /processes/echo/execution HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
      "application/json\r\nContent-Length: 13\r\n\r\n{\"inputs\":{}}";
  for (std::size_t size = 0; size <= whole.size(); size += 3)
    HttpConnection(server.port()).send(whole.substr(0, size));
  EXPECT_EQ(server.get("/health").status, 200);
}

TEST(ServeHttp, NoFileOutsideOfASceneCanBeReached) {
  namespace fs = std::filesystem;
  const ServedTerrain& terrain = ServedTerrain::get();
  const fs::path scene = terrain.scene();
  std::ofstream(terrain.path("secret.txt")) << "not for you";
  fs::create_symlink(terrain.path("secret.txt"), scene / "link.txt");
  fs::create_directory_symlink(scene.parent_path(), scene / "up");
  fs::create_directory_symlink("/", scene / "root");
  ServeOptions options = TestServer::served();
  options.page_folder = terrain.path("page");
  fs::create_directories(fs::path(options.page_folder) / "assets");
  std::ofstream(fs::path(options.page_folder) / "index.html") << "<html>page</html>";
  std::ofstream(fs::path(options.page_folder) / "assets/a.js") << "1";
  const TestServer server(options);
  for (const char* below : {"../secret.txt",
                            "..%2fsecret.txt",
                            "%2e%2e/secret.txt",
                            "%2E%2E%2Fsecret.txt",
                            "..%252fsecret.txt",
                            "%252e%252e/secret.txt",
                            "....//secret.txt",
                            ".%2e/secret.txt",
                            "..%5csecret.txt",
                            "..\\secret.txt",
                            "%c0%ae%c0%ae/secret.txt",
                            "link.txt",
                            "up/secret.txt",
                            "root/etc/passwd",
                            "/etc/passwd",
                            "%2fetc%2fpasswd",
                            "scene.json%00.txt",
                            "scene.json/",
                            "./scene.json",
                            "tiles",
                            "",
                            "tiles/../scene.json",
                            "%",
                            "%4",
                            "%zz"}) {
    for (const std::string start :
         {"/scenes/valley/files/", "/scenes/valley/3dtiles/", "/assets/"}) {
      const HttpAnswer answer = server.get(start + below);
      EXPECT_GE(answer.status, 400) << start << below;
      EXPECT_LT(answer.status, 500) << start << below;
      EXPECT_EQ(answer.body.find("not for you"), std::string::npos) << start << below;
      EXPECT_EQ(answer.body.find("root:"), std::string::npos) << start << below;
    }
  }
  for (const char* name : {"../valley.scene", "%2e%2e", "valley.scene", "/etc", "valley%00", "."})
    EXPECT_GE(server.get(std::string("/scenes/") + name).status, 400) << name;
  // What is there can be had.
  EXPECT_EQ(server.get("/scenes/valley/files/scene.json").status, 200);
  EXPECT_EQ(server.get("/scenes/valley/files/%73cene.json").status, 200);
  EXPECT_EQ(server.get("/scenes/alps/files/scene.json").status, 404);
  EXPECT_EQ(server.get("/assets/a.js").body, "1");
  EXPECT_EQ(server.get("/").body, "<html>page</html>");
  for (const char* name : {"link.txt", "up", "root"}) fs::remove(scene / name);
}

TEST(ServeHttp, FilesComeInRangesAndNotTwice) {
  const TestServer server;
  const std::string file = "/scenes/valley/files/scene.json";
  const HttpAnswer whole = server.get(file);
  ASSERT_EQ(whole.status, 200);
  const HttpAnswer part = server.get(file, "Range: bytes=10-19\r\n");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, whole.body.substr(10, 10));
  EXPECT_EQ(part.headers.at("content-range"), "bytes 10-19/" + std::to_string(whole.body.size()));
  EXPECT_EQ(server.get(file, "Range: bytes=-7\r\n").body, whole.body.substr(whole.body.size() - 7));
  expect_problem(server.get(file, "Range: bytes=99999999-\r\n"), 416);
  const std::string etag = whole.headers.at("etag");
  EXPECT_EQ(server.get(file, "If-None-Match: " + etag + "\r\n").status, 304);
}

TEST(ServeHttp, PagesFromElsewhereMayNotAsk) {
  const TestServer server;
  expect_problem(server.post("/processes/echo/execution", "{}", "Origin: https://evil.example\r\n"),
                 403);
  EXPECT_EQ(server.post("/processes/echo/execution", "{}", "Origin: http://localhost\r\n").status,
            200);
  for (const char* host : {"evil.example", "127.evil.example", "localhost.evil.example:80"}) {
    HttpConnection renamed(server.port());
    renamed.send(std::string("GET /scenes HTTP/1.1\r\nHost: ") + host + "\r\n\r\n");
    expect_problem(renamed.receive(), 421);
  }
  HttpConnection text(server.port());
  text.send(
      "POST /processes/echo/execution HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
      "text/plain\r\nContent-Length: 2\r\n\r\n{}");
  expect_problem(text.receive(), 415);
  EXPECT_FALSE(server.get("/health").headers.contains("access-control-allow-origin"));
  ServeOptions options = TestServer::served();
  options.cors_origin = "https://maps.example";
  const TestServer open(options);
  EXPECT_EQ(open.get("/health").headers.at("access-control-allow-origin"), "https://maps.example");
  EXPECT_EQ(open.post("/processes/echo/execution", "{}", "Origin: https://maps.example\r\n").status,
            200);
  HttpConnection preflight(open.port());
  preflight.send("OPTIONS /processes/echo/execution HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(preflight.receive(true).status, 204);
}

TEST(ServeHttp, TooMuchAtOnceAndTooLongAreRefused) {
  ServeOptions options = TestServer::served();
  options.limits.waiting = 0;
  const TestServer full(options);
  const HttpAnswer refused = full.get("/scenes/alps/tiles/hillshade/10/536/361.png");
  expect_problem(refused, 429);
  EXPECT_EQ(refused.headers.at("retry-after"), "1");
  EXPECT_EQ(full.get("/scenes").status, 200);  // what takes no time takes no turn
  options = TestServer::served();
  options.limits.time_s = 1e-9;
  const TestServer hasty(options);
  expect_problem(hasty.get("/scenes/alps/viewshed.json?observer=8.65,46.55"), 503);
  options = TestServer::served();
  options.limits.cells = 100;
  const TestServer small(options);
  expect_problem(small.get("/scenes/alps/viewshed.json?observer=8.65,46.55"), 413);
  EXPECT_EQ(small.get("/scenes/alps/viewshed.json?observer=8.65,46.55&max_distance_m=200").status,
            200);
}

/// A server whose only answer is given by hand.
class ServeStop : public testing::Test {
 protected:
  ServeStop()
      : server_("127.0.0.1", 0, HttpLimits(),
                [this](std::shared_ptr<const HttpRequest> request, Reply reply) {
                  asked_.set_value({std::move(request), std::move(reply)});
                }),
        thread_([this] { server_.run(); }) {}
  ~ServeStop() override {
    server_.stop(std::chrono::seconds(5));
    if (thread_.joinable()) thread_.join();
  }

  std::promise<std::pair<std::shared_ptr<const HttpRequest>, Reply>> asked_;
  HttpServer server_;
  std::thread thread_;
};

TEST_F(ServeStop, FinishesWhatRunsAndRefusesTheRest) {
  HttpConnection running(server_.port()), idle(server_.port()), late(server_.port());
  late.send("GET /late HTTP/1.1\r\n");  // not whole yet
  ASSERT_TRUE(running.send("GET /slow HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  const auto asked = asked_.get_future().get();
  EXPECT_EQ(asked.first->target, "/slow");
  // All three are known, and what the late one sent has been looked at.
  for (int i = 0; i < 500 && server_.counts().open_connections < 3; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  server_.stop(std::chrono::seconds(20));
  EXPECT_TRUE(idle.is_closed());
  late.send("Host: localhost\r\n\r\n");
  EXPECT_EQ(late.receive().status, 503);
  asked.second(text_response(200, "text/plain", "done"));
  EXPECT_EQ(running.receive().body, "done");
  thread_.join();
}

TEST_F(ServeStop, TellsTheWorkThatItsClientLeft) {
  HttpConnection leaving(server_.port());
  ASSERT_TRUE(leaving.send("GET /slow HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  const auto asked = asked_.get_future().get();
  EXPECT_FALSE(*asked.first->left);
  leaving.close();
  for (int i = 0; i < 500 && !*asked.first->left; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(*asked.first->left);
  asked.second(text_response(200, "text/plain", "for nobody"));
}

}  // namespace
}  // namespace scarp
