#include <fmt/format.h>

#include <array>
#include <string_view>

#include "cli/serve/api.h"
#include "cli/serve/json_schema.h"
#include "cli/serve/negotiation.h"
#include "cli/serve/problem.h"
#include "core/threads/stop.h"

namespace scarp {
namespace {

using nlohmann::json;

json summary_of(const Process& process) {
  return {{"id", process.id},
          {"title", process.title},
          {"description", process.description},
          {"version", SCARP_VERSION},
          {"jobControlOptions", {"sync-execute", "async-execute", "dismiss"}},
          {"outputTransmission", {"value"}}};
}

json description_of(const Process& process) {
  json description = summary_of(process);
  description["inputs"] = process.inputs;
  json schemas = json::array();
  for (const std::string& format : process.formats)
    schemas.push_back(format == "application/json"
                          ? process.output_schema
                          : json{{"type", "string"},
                                 {"contentEncoding", format.ends_with("json") ? "utf-8" : "binary"},
                                 {"contentMediaType", format}});
  description["outputs"] = {
      {process.output,
       {{"title", process.title},
        {"schema", schemas.size() == 1 ? schemas[0] : json{{"oneOf", schemas}}}}}};
  return description;
}

/// What may be posted to a process.
json execute_schema(const Process& process) {
  return {{"type", "object"},
          {"properties",
           {{"inputs", process.inputs_schema()},
            {"outputs",
             {{"type", "object"},
              {"properties",
               {{process.output,
                 {{"type", "object"},
                  {"properties",
                   {{"format",
                     {{"type", "object"},
                      {"properties", {{"mediaType", {{"type", "string"}, {"maxLength", 200}}}}}}},
                    {"transmissionMode", {{"type", "string"}, {"enum", {"value"}}}}}}}}}},
              {"additionalProperties", false}}},
            {"response", {{"type", "string"}, {"enum", {"raw", "document"}}}}}},
          {"additionalProperties", false}};
}

std::string base64_of(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three =
          (three << 8U) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kDigits[(three >> (18 - 6 * k)) & 63U];
  }
  return text;
}

/// A result as a member of the document with all outputs.
HttpResponse as_document_of(const Process& process, const std::string& format,
                            const HttpResponse& result) {
  json value;
  if (format == "application/json") {
    value = json::parse(*result.body);
    // The standard has objects as values of their own, so that a member named "value" is no riddle.
    if (value.is_object()) value = {{"value", value}};
  } else if (format.ends_with("json")) {
    value = {{"value", json::parse(*result.body)}, {"mediaType", format}};
  } else {
    value = {{"value", base64_of(*result.body)}, {"encoding", "base64"}, {"mediaType", format}};
  }
  return json_response({{process.output, value}});
}

/// The format that an execution asks for: of its outputs, or of the Accept header. Throws
/// Refusal{400, 406}.
std::string format_of(const Process& process, const json& body, std::string_view accept) {
  const json::json_pointer place("/outputs/" + process.output + "/format/mediaType");
  if (body.contains(place)) {
    const auto asked = body[place].get<std::string>();
    const auto chosen = choose_media_type(asked, process.formats);
    if (!chosen || asked.find('*') != std::string::npos)
      throw Refusal(400, fmt::format("outputs.{}.format.mediaType: '{}' is none of {}",
                                     process.output, asked, fmt::join(process.formats, ", ")));
    return process.formats[*chosen];
  }
  const auto chosen = choose_media_type(accept, process.formats);
  if (!chosen)
    throw Refusal(406,
                  fmt::format("the result can be had as {}", fmt::join(process.formats, ", ")));
  return process.formats[*chosen];
}

/// {"value": ...} of a qualified input as its value.
void unwrap_inputs(json& inputs) {
  for (auto& [name, value] : inputs.items())
    if (value.is_object() && value.contains("value") &&
        (value.size() == 1 || value.contains("mediaType")))
      value = json(value["value"]);
}

}  // namespace

const Process& Api::require_process(const std::string& id) const {
  for (const Process& process : processes_)
    if (process.id == id) return process;
  std::vector<std::string> ids;
  for (const Process& process : processes_) ids.push_back(process.id);
  throw Refusal(404,
                fmt::format("process '{}': is not known; known are {}", id, fmt::join(ids, ", ")),
                kNoSuchProcess);
}

void Api::add_process_routes() {
  const json none = json::object();
  add({"GET", "/processes", "processes", "All processes", none, false, [this](Call& call) {
         json all = json::array();
         for (const Process& process : processes_) {
           json summary = summary_of(process);
           summary["links"] = {link(call, "self", "/processes/" + process.id)};
           all.push_back(std::move(summary));
         }
         return json_response({{"processes", all}, {"links", {link(call, "self", "/processes")}}});
       }});
  add({"GET", "/processes/{id}", "process", "A process, its inputs and outputs", none, false,
       [this](Call& call) {
         const Process& process = require_process(call.path["id"]);
         json description = description_of(process);
         description["links"] = {link(call, "self", "/processes/" + process.id),
                                 link(call, "http://www.opengis.net/def/rel/ogc/1.0/execute",
                                      "/processes/" + process.id + "/execution")};
         return json_response(description);
       }});
  add({"POST", "/processes/{id}/execution", "execute",
       "Runs a process; as a job with the header Prefer: respond-async", none, true,
       [this](Call& call) { return execute(call); }});
  json limit;
  limit["limit"] = {{"description", "Jobs at most"},
                    {"schema", {{"type", "integer"}, {"minimum", 1}, {"maximum", 1000}}},
                    {"required", false}};
  add({"GET", "/jobs", "jobs", "All jobs, the newest first", limit, false, [this](Call& call) {
         json all = json::array();
         const auto most = static_cast<std::size_t>(call.query.value("limit", 1000));
         for (const auto& job : jobs_.all())
           if (all.size() < most) all.push_back(job->status_info(call.origin));
         HttpResponse response =
             json_response({{"jobs", all}, {"links", {link(call, "self", "/jobs")}}});
         response.set("Cache-Control", "no-store");
         return response;
       }});
  add({"GET", "/jobs/{id}", "job", "How far a job is", none, false, [this](Call& call) {
         HttpResponse response =
             json_response(jobs_.require(call.path["id"])->status_info(call.origin));
         response.set("Cache-Control", "no-store");
         return response;
       }});
  add({"GET", "/jobs/{id}/results", "results", "What a job made", none, false, [this](Call& call) {
         const auto job = jobs_.require(call.path["id"]);
         if (job->status() == Job::Status::kDismissed)
           throw Refusal(410, "the job was dismissed, and has no result");
         const auto result = job->result();
         if (!result) throw Refusal(404, "the job is not over; ask again later", kResultNotReady);
         return *result;
       }});
  add({"DELETE", "/jobs/{id}", "dismiss", "Stops a job, or forgets one that is over", none, false,
       [this](Call& call) {
         const auto job = jobs_.require(call.path["id"]);
         job->dismiss();
         jobs_.remove(job->id());
         json info = job->status_info(call.origin);
         info["status"] = "dismissed";
         return json_response(info);
       }});
}

HttpResponse Api::run(const Process& process, const json& inputs, const std::string& format,
                      bool as_document, const Progress& progress, const std::string& origin) {
  ProcessContext context{*scenes_, options_.limits, views_, progress, origin};
  HttpResponse response = process.run(inputs, format, context);
  return as_document ? as_document_of(process, format, response) : response;
}

HttpResponse Api::execute(Call& call) {
  const Process& process = require_process(call.path["id"]);
  const std::string_view type = call.request->header("content-type");
  static const std::vector<std::string> kJson = {"application/json"};
  if (type.find('*') != std::string_view::npos || type.empty() || !choose_media_type(type, kJson))
    throw Refusal(415, "a body of type application/json was expected");
  json body = parse_json(call.request->body);
  if (body.is_object() && body.contains("inputs") && body["inputs"].is_object())
    unwrap_inputs(body["inputs"]);
  if (body.is_object() && !body.contains("inputs")) body["inputs"] = json::object();
  if (const auto fault = schema_fault(execute_schema(process), body, ""))
    throw Refusal(400, *fault);
  const std::string format = format_of(process, body, call.request->header("accept"));
  const bool as_document = body.value("response", "raw") == "document";
  if (parse_prefer(call.request->header("prefer")).respond_async)
    return begin_job(call, process, body["inputs"], format, as_document);
  return run(process, body["inputs"], format, as_document, {}, call.origin);
}

HttpResponse Api::begin_job(Call& call, const Process& process, const json& inputs,
                            const std::string& format, bool as_document) {
  const auto job = jobs_.add(process.id);
  if (!job) throw Refusal(429, "too many jobs are under way; ask again when one is over");
  PoolTask task;
  task.client = call.request->client;
  task.refuse = [job](PoolTask::Why why) {
    job->fail(problem(
        503, why == PoolTask::Why::kClosing ? "the server is stopping" : "the job was dismissed"));
  };
  task.is_not_wanted = [job] { return job->is_dismissed(); };
  task.run = [this, job, &process, inputs, format, as_document, origin = call.origin] {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(options_.limits.job_time_s));
    const StopAsked stop = [job, end] { return job->is_dismissed() || Clock::now() > end; };
    const StopScope scope(stop);
    job->start();
    try {
      job->finish(run(
          process, inputs, format, as_document, [job](double done) { job->progress(done); },
          origin));
    } catch (const std::exception& error) {
      job->fail(problem_of(error));
    }
  };
  if (!job_pool_->submit(std::move(task))) {
    jobs_.remove(job->id());
    throw Refusal(429, "too many jobs are under way; ask again when one is over");
  }
  HttpResponse response = json_response(job->status_info(call.origin), 201);
  response.set("Location", call.origin + "/jobs/" + job->id());
  response.set("Preference-Applied", "respond-async");
  return response;
}

}  // namespace scarp
