#include "client/ctl/AnimationVerbs.h"

#include <fmt/format.h>

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
    bool playing = false;
};

/// Nothing of other objects.
std::optional<PlayerLine> lineOf(const Object& core) {
    PlayerLine line;
    if (const auto* animation = core.as<Animation>()) {
        line.channels = animation->channels.size();
        line.time = animation->time;
        line.speed = animation->speed;
        line.playing = animation->playing;
    } else if (const auto* motion = core.as<Motion>()) {
        line.time = motion->time;
        line.playing = motion->playing;
    } else {
        return std::nullopt;
    }
    line.kind = core.info().name;
    line.mode = wordFor(core, "mode");
    return line;
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Animations&) {
    std::vector<PlayerLine> lines;
    for (const ObjectType type : {typeOf<Animation>(), typeOf<Motion>()}) {
        const Expected<SceneExcerpt> told = application.fetchTree({.coreType = type});
        if (!told) return tl::unexpected(told.error());
        for (const TreeNode& node : told->nodes()) {
            const Object core = told->coreOf(node.node);
            std::optional<PlayerLine> line = core ? lineOf(core) : std::nullopt;
            if (!line) continue;
            line->node = node.node;
            lines.push_back(std::move(*line));
        }
    }
    if (lines.empty()) return Answer{"the scene has no animations\n", {{"animations", nlohmann::ordered_json::array()}}, {}};
    SceneNames names(application);
    std::vector<ObjectId> nodes;
    for (const PlayerLine& line : lines) nodes.push_back(line.node);
    names.learn(nodes);
    TextTable table({"node", "kind", "channels", "mode", "time s", "speed", ""});
    nlohmann::ordered_json entries = nlohmann::ordered_json::array();
    for (const PlayerLine& line : lines) {
        table.add({names.node(line.node), line.kind, std::to_string(line.channels), line.mode, fmt::format("{:.3f}", line.time), fmt::format("{:g}", line.speed), line.playing ? "plays" : "stands"});
        entries.push_back({{"node", names.node(line.node)}, {"id", line.node.value}, {"kind", line.kind}, {"channels", line.channels}, {"mode", line.mode}, {"time", line.time}, {"speed", line.speed}, {"playing", line.playing}});
    }
    return Answer{table.text(), {{"animations", std::move(entries)}}, {}};
}

Expected<Answer> run(Application& application, const verb::Play& wanted) {
    const Expected<ObjectInfo> node = application.describeNode(wanted.node);
    if (!node) return tl::unexpected(node.error());
    const bool animation = node->core && node->coreType == typeOf<Animation>(), motion = node->core && node->coreType == typeOf<Motion>();
    if (!animation && !motion) return fail(ErrorCode::kNotFound, fmt::format("{} is no animation; see animations for those there are", wanted.node));
    if (wanted.speed && motion) return fail(ErrorCode::kRefused, fmt::format("{} is a Motion, which has no speed", wanted.node));
    ChangeListBuilder edits;
    std::string said;
    if (wanted.playing) {
        animation ? setField<&Animation::playing>(edits, node->core, *wanted.playing) : setField<&Motion::playing>(edits, node->core, *wanted.playing);
        said = *wanted.playing ? "plays" : "stands";
    }
    if (wanted.time) {
        animation ? setField<&Animation::time>(edits, node->core, *wanted.time) : setField<&Motion::time>(edits, node->core, *wanted.time);
        said = fmt::format("is at {:g} s", *wanted.time);
    }
    if (wanted.speed) {
        setField<&Animation::speed>(edits, node->core, *wanted.speed);
        said = fmt::format("has the speed {:g}", *wanted.speed);
    }
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    return Answer{fmt::format("{} {} (change {})\n", node->path, said, committed->sequence.value), {{"sequence", committed->sequence.value}, {"node", node->path}}, {}};
}

}  // namespace tessera
