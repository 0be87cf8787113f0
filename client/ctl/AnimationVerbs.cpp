#include "client/ctl/AnimationVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "client/ctl/SceneNames.h"
#include "client/ctl/TextTable.h"

namespace tessera {
namespace {

std::string wordFor(const Object& player, std::string_view field) {
    const FieldEntry& entry = *findField(player.info(), field);
    return wordOfNumber(entry, std::get<std::int64_t>(entry.load(player))).value_or("?");
}

struct PlayerLine {
    ObjectId node;
    std::string kind, mode;
    std::size_t channels = 1;
    double time = 0, speed = 1;
    std::optional<double> length = {};  ///< s; nothing: not known (yet)
    bool playing = false;
    std::vector<ObjectId> tracks = {};  ///< its key frames
    std::size_t keys = 0;               ///< of the longest of them
    std::string problem = {};           ///< of a film
};

/// Nothing of other objects.
std::optional<PlayerLine> lineOf(const Object& core) {
    PlayerLine line;
    if (const auto* animation = core.as<Animation>()) {
        line.channels = animation->channels.size();
        line.tracks = animation->channels;
        line.time = animation->time;
        line.speed = animation->speed;
        line.playing = animation->playing;
    } else if (const auto* motion = core.as<Motion>()) {
        line.time = motion->time;
        line.playing = motion->playing;
        line.keys = motion->keys.sizeBytes() / (11 * sizeof(double));
    } else if (const auto* movie = core.as<Movie>()) {
        line.time = movie->time;
        line.speed = movie->speed;
        line.playing = movie->playing;
        line.problem = movie->problem;
    } else {
        return std::nullopt;
    }
    line.kind = core.info().name;
    line.mode = wordFor(core, "mode");
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
            if (const KeyFrames* frames = told->get<KeyFrames>(track)) line.keys = std::max<std::size_t>(line.keys, frames->times.sizeBytes() / sizeof(double));
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Animations&) {
    std::vector<PlayerLine> lines;
    for (const ObjectType type : {typeOf<Animation>(), typeOf<Motion>(), typeOf<Movie>()}) {
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
    if (lines.empty()) return Answer{"the scene has no animations\n", {{"animations", nlohmann::ordered_json::array()}}, {}};
    SceneNames names(application);
    std::vector<ObjectId> nodes;
    for (const PlayerLine& line : lines) nodes.push_back(line.node);
    names.learn(nodes);
    countKeys(application, lines);
    TextTable table({"node", "kind", "channels", "keys", "mode", "time s", "of s", "speed", ""});
    nlohmann::ordered_json entries = nlohmann::ordered_json::array();
    for (const PlayerLine& line : lines) {
        const std::string state = !line.problem.empty() ? "problem: " + line.problem : line.playing ? "plays" : "stands";
        table.add({names.node(line.node), line.kind, std::to_string(line.channels), line.keys > 0 ? std::to_string(line.keys) : "-", line.mode,
                   fmt::format("{:.3f}", line.time), line.length ? fmt::format("{:.3f}", *line.length) : "-", fmt::format("{:g}", line.speed), state});
        entries.push_back({{"node", names.node(line.node)}, {"id", line.node.value}, {"kind", line.kind}, {"channels", line.channels}, {"keys", line.keys},
                           {"problem", line.problem}, {"mode", line.mode}, {"time", line.time}, {"length", nullptr}, {"speed", line.speed}, {"playing", line.playing}});
        if (line.length) entries.back()["length"] = *line.length;
    }
    return Answer{table.text(), {{"animations", std::move(entries)}}, {}};
}

Expected<Answer> run(Application& application, const verb::Play& wanted) {
    const Expected<ObjectInfo> node = application.describeNode(wanted.node);
    if (!node) return tl::unexpected(node.error());
    const ObjectType type = node->core ? node->coreType : ObjectType{};
    const bool motion = type == typeOf<Motion>();
    if (!motion && type != typeOf<Animation>() && type != typeOf<Movie>())
        return fail(ErrorCode::kNotFound, fmt::format("{} is no animation; see animations for those there are", wanted.node));
    if (wanted.speed && motion) return fail(ErrorCode::kRefused, fmt::format("{} is a Motion, which has no speed", wanted.node));
    ChangeListBuilder edits;
    std::string said;
    const auto set = [&]<auto kOfAnimation, auto kOfMotion, auto kOfMovie>(const auto& value) {
        if (motion) setField<kOfMotion>(edits, node->core, value);
        else if (type == typeOf<Movie>()) setField<kOfMovie>(edits, node->core, value);
        else setField<kOfAnimation>(edits, node->core, value);
    };
    if (wanted.playing) {
        set.template operator()<&Animation::playing, &Motion::playing, &Movie::playing>(*wanted.playing);
        said = *wanted.playing ? "plays" : "stands";
    }
    if (wanted.time) {
        set.template operator()<&Animation::time, &Motion::time, &Movie::time>(*wanted.time);
        said = fmt::format("is at {:g} s", *wanted.time);
    }
    if (wanted.speed) {
        type == typeOf<Movie>() ? setField<&Movie::speed>(edits, node->core, *wanted.speed) : setField<&Animation::speed>(edits, node->core, *wanted.speed);
        said = fmt::format("has the speed {:g}", *wanted.speed);
    }
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    return Answer{fmt::format("{} {} (change {})\n", node->path, said, committed->sequence.value), {{"sequence", committed->sequence.value}, {"node", node->path}}, {}};
}

}  // namespace tessera
