#include "server/tools/replay/ReplayAnswers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "server/collision/mesh/InstructionSet.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Vec3d& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

/// A name in a scene may be any bytes; a line of JSON may not.
std::string line(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

struct Times {
    double mean = 0, median = 0, p99 = 0, max = 0;
};
Times timesOf(std::vector<double> ms) {
    if (ms.empty()) return {};
    std::ranges::sort(ms);
    const auto rank = [&](double share) {
        return ms[static_cast<std::size_t>(std::ceil(share * static_cast<double>(ms.size()))) - 1];
    };
    return {.mean = std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size()),
            .median = rank(0.5),
            .p99 = rank(0.99),
            .max = ms.back()};
}

const char* nameOf(ReplayResult::End end) {
    switch (end) {
        case ReplayResult::End::kClosed:
            return "closed";
        case ReplayResult::End::kCutOff:
            return "cut off";
        case ReplayResult::End::kMaxFrames:
            return "frames";
        case ReplayResult::End::kDamaged:
            return "damaged";
    }
    return "";
}

/// What a reader should know beside the verdict.
std::vector<std::string> notesOf(const ReplaySummary& summary) {
    std::vector<std::string> notes;
    if (summary.opening.collisionLimits != digestOf(CollisionLimits()))
        notes.emplace_back(
            "the recording program had other collision limits than this one: results may differ for that alone");
    if (summary.result.end == ReplayResult::End::kCutOff)
        notes.emplace_back("the recording was cut off: its server did not end in order, or records still");
    if (summary.result.unfinishedFrame)
        notes.push_back(
            fmt::format("frame {} has no outcome in the recording: the server was at work on it; it was made again, "
                        "with nothing to compare",
                        summary.result.unfinishedFrame->value));
    return notes;
}

}  // namespace

std::string contactsLine(FrameNumber frame, const FrameResult& made, const Aspect& scene) {
    Json contacts = Json::array();
    for (const Contact& contact : made.collision.contacts)
        contacts.push_back({{"objects", {pathOf(scene, contact.objectA), pathOf(scene, contact.objectB)}},
                            {"faces", {contact.faceA, contact.faceB}},
                            {"point", toJson(contact.point)},
                            {"normal", toJson(contact.normal)},
                            {"interest", contact.interest.value},
                            {"time", contact.time}});
    return line({{"frame", frame.value},
                 {"state_hash", toHex(made.commit.sent->stateHash)},
                 {"contacts", std::move(contacts)}});
}

std::string summaryText(const ReplaySummary& summary) {
    const ReplayResult& result = summary.result;
    const record::Opening& opening = summary.opening;
    const Times times = timesOf(result.frameMs);
    std::string text = fmt::format("{}: recorded by {} on {} with {} thread{}\n", summary.file, opening.program,
                                   opening.instructionSet, opening.threads, opening.threads == 1 ? "" : "s");
    text += fmt::format("{} frames on {} with {} thread{}: {:.3f} ms each (p99 {:.3f}, max {:.3f})\n", result.frames,
                        name(instructionSet()), summary.threads, summary.threads == 1 ? "" : "s", times.mean, times.p99,
                        times.max);
    for (const std::string& note : notesOf(summary)) text += "note: " + note + "\n";
    if (result.firstDifference) {
        text += result.firstDifference->frame
                    ? fmt::format("differs first in frame {} ({} frames differ):\n",
                                  result.firstDifference->frame->value, result.differingFrames)
                    : std::string("the start scene differs:\n");
        for (const std::string& what : result.firstDifference->what) text += "  " + what + "\n";
    } else if (result.end != ReplayResult::End::kDamaged) {
        text += "the same: every frame's contacts, their order and the scene are those of the recording\n";
    }
    return text;
}

std::string summaryJson(const ReplaySummary& summary) {
    const ReplayResult& result = summary.result;
    const Times times = timesOf(result.frameMs);
    Json json{{"file", summary.file},
              {"recorded",
               {{"program", summary.opening.program},
                {"instruction_set", summary.opening.instructionSet},
                {"threads", summary.opening.threads}}},
              {"threads", summary.threads},
              {"instruction_set", name(instructionSet())},
              {"frames", result.frames},
              {"frame_ms", {{"mean", times.mean}, {"p50", times.median}, {"p99", times.p99}, {"max", times.max}}},
              {"result", result.end == ReplayResult::End::kDamaged ? "damaged"
                         : result.firstDifference                  ? "different"
                                                                   : "same"},
              {"end", nameOf(result.end)},
              {"differing_frames", result.differingFrames},
              {"notes", notesOf(summary)}};
    if (result.firstDifference) {
        Json frame = result.firstDifference->frame ? Json(result.firstDifference->frame->value) : Json(nullptr);
        json["first_difference"] = {{"frame", std::move(frame)}, {"what", result.firstDifference->what}};
    }
    if (result.end == ReplayResult::End::kDamaged) json["error"] = result.error.message;
    return line(json);
}

}  // namespace tessera
