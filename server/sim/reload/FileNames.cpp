#include "server/sim/reload/FileNames.h"

#include <algorithm>
#include <deque>

#include <fmt/format.h>

#include "common/cores/Node.h"

namespace tessera {

std::string FileNames::pathOf(std::uint32_t node) const {
    static const FieldEntry& kName = *findField(*findType(typeOf<Node>()), fieldId<&Node::name>);
    std::vector<std::string> steps;
    for (; node != FileObjects::kNone; node = file_.parent(node))
        steps.push_back(std::get<std::string>(file_.value(node, kName)));
    std::string path;
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) path += "/" + *step;
    return path;
}

std::string FileNames::of(std::uint32_t place) const {
    if (file_.isNode(place)) return pathOf(place);
    if (bearers_.empty()) {
        bearers_.assign(file_.count(), FileObjects::kNone);
        std::deque<std::uint32_t> open;
        for (std::uint32_t node = 0; node < file_.count(); ++node)
            if (file_.isNode(node)) bearers_[node] = node, open.push_back(node);
        for (; !open.empty(); open.pop_front())
            file_.forEachRef(open.front(), [&](std::uint32_t to) {
                if (bearers_[to] != FileObjects::kNone) return;
                bearers_[to] = bearers_[open.front()];
                open.push_back(to);
            });
    }
    const std::uint32_t bearer = bearers_[place];
    return bearer == FileObjects::kNone ? fmt::format("a {}", file_.type(place).name)
                                        : fmt::format("the {} of {}", file_.type(place).name, pathOf(bearer));
}

}  // namespace tessera
