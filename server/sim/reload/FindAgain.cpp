#include <deque>
#include <map>
#include <string>
#include <unordered_set>
#include <utility>

#include "common/cores/Node.h"
#include "server/sim/reload/HeldFile.h"

namespace tessera {
namespace {

class Finder {
public:
    Finder(const Aspect& scene, HeldFile& file) : scene_(scene), file_(file), objects_(file.list) {}

    std::size_t run(ObjectId below) {
        if (const Node* top = scene_.get<Node>(below)) findChildren(*top, objects_.children(objects_.count()));
        for (; !open_.empty(); open_.pop_front()) {
            const auto [id, place] = open_.front();
            if (const Node* node = scene_.get<Node>(id)) findChildren(*node, objects_.children(place));
            findReferred(scene_.find(id), place);
        }
        return found_.size();
    }

private:
    /// A name, and the type of the core.
    using Called = std::pair<std::string, std::uint16_t>;

    void take(ObjectId id, std::uint32_t place) {
        if (file_.ids[place] || !scene_.find(id) || scene_.find(id).info().index != objects_.type(place).index) return;
        if (!found_.insert(id).second) return;
        file_.ids[place] = id;
        open_.emplace_back(id, place);
    }

    void findChildren(const Node& above, std::span<const std::uint32_t> places) {
        std::map<Called, std::deque<ObjectId>> there;
        for (const ObjectId child : above.children) {
            const Node& node = *scene_.get<Node>(child);
            const Object core = node.core ? scene_.find(node.core) : Object();
            there[{node.name, core ? core.info().type.value : std::uint16_t{0}}].push_back(child);
        }
        for (const std::uint32_t place : places) {
            const Node node = nodeAt(place);
            const std::uint32_t core = objects_.placeOf(node.core);
            const auto alike =
                there.find({node.name, core == FileObjects::kNone ? std::uint16_t{0} : objects_.type(core).type.value});
            if (alike == there.end() || alike->second.empty()) continue;
            take(alike->second.front(), place);
            alike->second.pop_front();
        }
    }
    [[nodiscard]] Node nodeAt(std::uint32_t place) const {
        static const FieldEntry& kName = *findField(*findType(typeOf<Node>()), fieldId<&Node::name>);
        static const FieldEntry& kCore = *findField(*findType(typeOf<Node>()), fieldId<&Node::core>);
        Node node;
        node.name = std::get<std::string>(objects_.value(place, kName));
        node.core = std::get<ObjectId>(objects_.value(place, kCore));
        return node;
    }

    void findReferred(const Object& object, std::uint32_t place) {
        if (!object.info().refers) return;
        const auto both = [this](ObjectId there, ObjectId said) {
            const std::uint32_t to = objects_.placeOf(said);
            if (to != FileObjects::kNone && !objects_.isNode(to)) take(there, to);
        };
        for (const FieldEntry& field : object.info().fields) {
            if (!field.holdsRefs()) continue;
            const FieldValue there = field.load(object), said = objects_.value(place, field);
            if (const auto* one = std::get_if<ObjectId>(&there)) both(*one, std::get<ObjectId>(said));
            if (const auto* some = std::get_if<RefList>(&there)) {
                const RefList& others = std::get<RefList>(said);
                for (std::size_t i = 0; i < std::min(some->size(), others.size()); ++i) both((*some)[i], others[i]);
            }
        }
    }

    const Aspect& scene_;
    HeldFile& file_;
    const FileObjects objects_;
    std::unordered_set<ObjectId> found_;
    std::deque<std::pair<ObjectId, std::uint32_t>> open_;
};

}  // namespace

std::size_t findAgain(const Aspect& scene, ObjectId below, HeldFile& file) {
    return Finder(scene, file).run(below);
}

}  // namespace tessera
