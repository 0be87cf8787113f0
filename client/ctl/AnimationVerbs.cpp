#include "client/ctl/AnimationVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "client/ctl/SceneNames.h"
#include "client/ctl/TextTable.h"
#include "common/animation/KeyTrack.h"
#include "common/cores/Motion.h"
#include "common/cores/Movie.h"
#include "common/cores/ParticleEmitter.h"

namespace tessera {
namespace {

std::string wordFor(const Object& player, std::string_view field) {
    const FieldEntry& entry = *findField(player.info(), field);
    return wordOfNumber(entry, std::get<std::int64_t>(entry.load(player))).value_or("?");
}

/// What plays by itself, as `animations` lists it.
constexpr std::array kPlayTypes = {typeOf<Animation>(), typeOf<Motion>(), typeOf<Movie>(), typeOf<ParticleEmitter>()};

/// Their fields have the same names; what has no `speed` has none.
struct PlayFields {
    const FieldEntry *playing = nullptr, *time = nullptr, *speed = nullptr;
    explicit operator bool() const { return playing; }
};
PlayFields playFieldsOf(ObjectType type) {
    if (std::ranges::find(kPlayTypes, type) == kPlayTypes.end()) return {};
    const TypeInfo& info = *findType(type);
    return {findField(info, "playing"), findField(info, "time"), findField(info, "speed")};
}

double numberIn(const FieldEntry& field, const Object& core) {
    double number = 0;
    FieldShape<double>::store(number, field.load(core));
    return number;
}

struct PlayerLine {
    ObjectId node;
    std::string kind, mode;
    std::size_t channels = 1;
    double time = 0, speed = 1;
    std::optional<double> length = {};  ///< s; nothing: not known (yet)
    bool playing = false;
    bool toAndFro = false;
    std::vector<ObjectId> tracks = {};  ///< its key frames
    std::size_t keys = 0;               ///< of the longest of them
    std::string problem = {};           ///< of a film
};

/// Nothing of what does not play.
std::optional<PlayerLine> lineOf(const Object& core) {
    const PlayFields fields = playFieldsOf(typeOf(core));
    if (!fields) return std::nullopt;
    PlayerLine line{.kind = std::string(core.info().name), .mode = "-"};
    line.playing = std::get<bool>(fields.playing->load(core));
    line.time = numberIn(*fields.time, core);
    if (fields.speed) line.speed = numberIn(*fields.speed, core);
    if (const auto* animation = core.as<Animation>()) {
        line.channels = animation->channels.size();
        line.tracks = animation->channels;
        line.toAndFro = animation->mode == Animation::kPingPong;
    } else if (const auto* motion = core.as<Motion>()) {
        line.keys = motion->keys.sizeBytes() / (11 * sizeof(double));
    } else if (const auto* movie = core.as<Movie>()) {
        line.problem = movie->problem;
    }
    // A stream of particles has no end: its mode says how it looks.
    if (!core.is<ParticleEmitter>()) line.mode = wordFor(core, "mode");
    return line;
}

/// How many keys the longest track of each has, where it is told: arrays themselves are not.
void countKeys(Application& application, std::vector<PlayerLine>& lines) {
    std::vector<ObjectId> all;
    for (const PlayerLine& line : lines) all.insert(all.end(), line.tracks.begin(), line.tracks.end());
    if (all.empty()) return;
    const Expected<SceneExcerpt> told = application.fetch(all);
    if (!told) return;
    for (PlayerLine& line : lines)
        for (const ObjectId track : line.tracks)
            if (const KeyFrames* frames = told->get<KeyFrames>(track))
                line.keys = std::max<std::size_t>(line.keys, frames->times.sizeBytes() / sizeof(double));
}

/// Where a seek leads, and how long what is sought lasts; nothing where that is not known (yet).
struct Sought {
    double time = 0;
    std::optional<double> length = {};
    bool goesRound = false;
    std::optional<double> shown = {};  ///< s, of what goes to and fro: where on its way back
};

/// Beyond an end the time stays there, or goes round, as it would if it played. What no time is stays, and the server
/// refuses it.
Sought soughtTime(Application& application, const ObjectInfo& node, double seconds) {
    Sought sought{.time = seconds};
    const Expected<SceneExcerpt> told =
        application.fetchTree({.node = node.id, .levels = 0, .coreType = node.coreType});
    if (!told || !std::isfinite(seconds)) return sought;
    sought.length = told->lengthOf(node.core);
    const Object core = told->find(node.core);
    if (!sought.length || !core) return sought;
    const auto* animation = core.as<Animation>();
    const auto* motion = core.as<Motion>();
    const auto* movie = core.as<Movie>();
    const bool once = animation ? animation->mode == Animation::kOnce
                      : motion  ? motion->mode == Motion::kOnce
                                : movie && movie->mode == Movie::kOnce;
    sought.goesRound = !once;
    // A motion that goes round counts on.
    if (once || !motion)
        sought.time = foldedTime(seconds, *sought.length,
                                 once        ? Animation::kOnce
                                 : animation ? animation->mode
                                             : Animation::kLoop);
    if (animation && animation->mode == Animation::kPingPong && sought.time > *sought.length)
        sought.shown = shownTime(sought.time, *sought.length, animation->mode);
    return sought;
}

std::string soughtText(const Sought& sought, double seconds) {
    if (!sought.length || (seconds >= 0 && seconds <= *sought.length)) return fmt::format("is at {:g} s", sought.time);
    // As short as tells the two apart.
    const bool alike = fmt::format("{:g}", seconds) == fmt::format("{:g}", *sought.length);
    const std::string end = alike ? fmt::format("{} s is beyond its end, {} s", seconds, *sought.length)
                                  : fmt::format("{:g} s is beyond its end, {:g} s", seconds, *sought.length);
    const std::string beyond = seconds < 0 ? fmt::format("{:g} s is before its beginning", seconds) : end;
    if (sought.shown)
        return fmt::format("is at {:g} s: {}, and it is on its way back, at {:g} s", sought.time, beyond,
                           *sought.shown);
    if (sought.goesRound) return fmt::format("is at {:g} s: {}, and it goes round", sought.time, beyond);
    return fmt::format("stopped at {:g} s: {}", sought.time, beyond);
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Animations&) {
    std::vector<PlayerLine> lines;
    for (const ObjectType type : kPlayTypes) {
        const Expected<SceneExcerpt> told = application.fetchTree({.coreType = type});
        if (!told) return tl::unexpected(told.error());
        for (const TreeNode& node : told->nodes()) {
            const Object core = told->coreOf(node.node);
            std::optional<PlayerLine> line = core ? lineOf(core) : std::nullopt;
            if (!line) continue;
            line->node = node.node;
            line->length = told->lengthOf(told->get<Node>(node.node)->core);
            lines.push_back(std::move(*line));
        }
    }
    if (lines.empty())
        return Answer{"the scene has no animations\n", {{"animations", nlohmann::ordered_json::array()}}, {}};
    SceneNames names(application);
    std::vector<ObjectId> nodes;
    for (const PlayerLine& line : lines) nodes.push_back(line.node);
    names.learn(nodes);
    countKeys(application, lines);
    TextTable table({"node", "kind", "channels", "keys", "mode", "time s", "of s", "speed", ""});
    nlohmann::ordered_json entries = nlohmann::ordered_json::array();
    for (const PlayerLine& line : lines) {
        // To and fro its time runs to twice its length.
        const bool back = line.toAndFro && line.length && line.time > *line.length;
        const double shown = back ? shownTime(line.time, *line.length, Animation::kPingPong) : line.time;
        const std::string state = (!line.problem.empty() ? "problem: " + line.problem
                                   : line.playing        ? "plays"
                                                         : "stands") +
                                  (back ? ", on its way back" : "");
        table.add({names.node(line.node), line.kind, std::to_string(line.channels),
                   line.keys > 0 ? std::to_string(line.keys) : "-", line.mode, fmt::format("{:.3f}", shown),
                   line.length ? fmt::format("{:.3f}", *line.length) : "-", fmt::format("{:g}", line.speed), state});
        entries.push_back({{"node", names.node(line.node)},
                           {"id", line.node.value},
                           {"kind", line.kind},
                           {"channels", line.channels},
                           {"keys", line.keys},
                           {"problem", line.problem},
                           {"mode", line.mode},
                           {"time", line.time},
                           {"shown", shown},
                           {"length", nullptr},
                           {"speed", line.speed},
                           {"playing", line.playing}});
        if (line.length) entries.back()["length"] = *line.length;
    }
    return Answer{table.text(), {{"animations", std::move(entries)}}, {}};
}

Expected<Answer> run(Application& application, const verb::Play& wanted) {
    const Expected<ObjectInfo> node = application.describeNode(wanted.node);
    if (!node) return tl::unexpected(node.error());
    const ObjectType type = node->core ? node->coreType : ObjectType{};
    const PlayFields fields = playFieldsOf(type);
    if (!fields)
        return fail(ErrorCode::kNotFound,
                    fmt::format("{} is no animation; see animations for those there are", wanted.node));
    if (wanted.speed && !fields.speed)
        return fail(ErrorCode::kRefused,
                    fmt::format("{} is a {}, which has no speed", wanted.node, findType(type)->name));
    ChangeListBuilder edits;
    std::string said;
    const auto set = [&](const FieldEntry& field, const auto& value) {
        edits.set(node->core, type, field.id, toValue(value));
    };
    if (wanted.playing) {
        set(*fields.playing, *wanted.playing);
        said = *wanted.playing ? "plays" : "stands";
    }
    std::optional<Sought> sought;
    if (wanted.time) {
        sought = soughtTime(application, *node, *wanted.time);
        set(*fields.time, sought->time);
        said = soughtText(*sought, *wanted.time);
    }
    if (wanted.speed) {
        set(*fields.speed, *wanted.speed);
        said = fmt::format("has the speed {:g}", *wanted.speed);
    }
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    nlohmann::ordered_json json = {{"sequence", committed->sequence.value}, {"node", node->path}};
    if (sought) {
        json["time"] = sought->time;
        json["length"] = nullptr;
        if (sought->length) json["length"] = *sought->length;
    }
    return Answer{fmt::format("{} {} (change {})\n", node->path, said, committed->sequence.value), std::move(json), {}};
}

}  // namespace tessera
