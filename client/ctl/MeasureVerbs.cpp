#include "client/ctl/MeasureVerbs.h"

#include <fmt/format.h>

#include "client/ctl/NumberText.h"
#include "client/ctl/SceneNames.h"

namespace tessera {

namespace {

bool isNode(const std::string& word) {
    return word.starts_with('/') || word.starts_with('#');
}

Expected<Vec3d> placeIn(const std::string& word) {
    Vec3d place;
    std::size_t at = 0;
    for (int i = 0; i < 3; ++i) {
        const std::size_t end = i < 2 ? word.find(',', at) : word.size();
        if (end == std::string::npos)
            return fail(ErrorCode::kUsage,
                        fmt::format("measure: \"{}\" is no place, as 0,1.5,-2 is one, and no node, as /hall is", word));
        const Expected<double> number = finiteNumber(word.substr(at, end - at), "measure");
        if (!number) return tl::unexpected(number.error());
        place[i] = *number;
        at = end + 1;
    }
    return place;
}

}  // namespace

Expected<verb::Measure> measureVerb(const std::string& from, const std::string& to) {
    if (isNode(from) && isNode(to))
        return fail(ErrorCode::kUsage, "measure: one of the two has to be a place, as 0,1.5,-2 is one");
    if (isNode(from)) return measureVerb(to, from);
    const Expected<Vec3d> start = placeIn(from);
    if (!start) return tl::unexpected(start.error());
    if (isNode(to)) return verb::Measure{*start, std::nullopt, to};
    const Expected<Vec3d> end = placeIn(to);
    if (!end) return tl::unexpected(end.error());
    return verb::Measure{*start, *end, {}};
}

Expected<Answer> run(Application& application, const verb::Measure& measure) {
    if (measure.to) {
        const Expected<answer::Measured> measured = application.measure(measure.from, *measure.to);
        if (!measured) return tl::unexpected(measured.error());
        return Answer{
            fmt::format("{} from {} to {}\n", readable(measured->distance), textOf(measured->from),
                        textOf(measured->to)),
            {{"distance", measured->distance}, {"from", jsonOf(measured->from)}, {"to", jsonOf(measured->to)}},
            {}};
    }
    const Expected<ObjectInfo> node = application.describeNode(measure.node);
    if (!node) return tl::unexpected(node.error());
    const Expected<answer::Measured> measured = application.measure(measure.from, node->id);
    if (!measured) return tl::unexpected(measured.error());
    SceneNames names(application);
    names.learn(std::span(&measured->node, 1));
    const std::string path = names.node(measured->node);
    Answer answer{
        fmt::format("{} from {} to {}, face {} at {}\nnormal {}", readable(measured->distance), textOf(measured->from),
                    path, measured->face, textOf(measured->to), textOf(measured->normal)),
        {{"distance", measured->distance},
         {"error", measured->error},
         {"from", jsonOf(measured->from)},
         {"to", jsonOf(measured->to)},
         {"node", measured->node.value},
         {"path", path},
         {"face", measured->face},
         {"normal", jsonOf(measured->normal)}},
        {}};
    if (measured->error > 0) answer.text += fmt::format(", to {}", readable(measured->error));
    answer.text += "\n";
    return answer;
}

}  // namespace tessera
