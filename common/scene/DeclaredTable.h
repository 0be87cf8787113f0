/// Typed data of nodes that an application declares to everybody: kept in the scene, so replicated, saved, undone;
/// SideTable's is its own.
///
///     DeclaredTable<double> scores({.key = "org.example.score", .encode = …, .decode = …}, {.changed = [](ObjectId
///     node, const double& score) { … }}); scores.lookAnew(application->scene()); application->onChanges([&](const
///     ChangeList& list, Sequence) { scores.follow(application->scene(), list); });
///     application->propose(scores.write(application->scene(), node, 17.5));
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "common/cores/ApplicationData.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// Which nodes have ApplicationData of one key, and which of their children bear it: follows a scene. A list costs a
/// look-up per entry, and what it says of such children. One thread at a time.
class DeclaredData {
public:
    explicit DeclaredData(std::string key) : key_(std::move(key)) {}
    /// After every list that was applied. Returns the nodes whose data may be other than before.
    [[nodiscard]] std::set<ObjectId> follow(const Aspect& aspect, const ChangeList& list);
    /// Before the first list, and after what is no list.
    [[nodiscard]] std::set<ObjectId> lookAnew(const Aspect& aspect);
    /// The child of the node that bears its data; none: it has none. Of several that of the lowest number counts.
    [[nodiscard]] ObjectId bearerOf(ObjectId node) const;
    /// The lists that give a node this data (in place of what it has), and that take it. Empty where nothing would
    /// change.
    [[nodiscard]] ChangeList write(const Aspect& aspect, ObjectId node, Blob data) const;
    [[nodiscard]] ChangeList erase(const Aspect& aspect, ObjectId node) const;

private:
    void look(const Aspect& aspect, ObjectId bearer, std::set<ObjectId>& touched);

    struct Place {
        ObjectId core, node;  ///< the node has its data; none: the key is another one, or it hangs nowhere
    };
    std::string key_;
    std::unordered_map<ObjectId, Place> bearers_;
    std::unordered_map<ObjectId, std::set<ObjectId>> bearersOf_;  ///< by core
    std::unordered_map<ObjectId, std::set<ObjectId>> ofNode_;
};

template <typename T>
class DeclaredTable {
public:
    struct Form {
        std::string key;
        std::function<Blob(const T&)> encode;
        std::function<std::optional<T>(const Blob&)>
            decode;  ///< nothing: these bytes are none, or not here (an application without `wantBlobs`)
    };
    /// Called while `follow` and `lookAnew` run, each node once, in the order of their numbers. They may look at the
    /// scene.
    struct Callbacks {
        std::function<void(ObjectId node, const T&)> changed = {};  ///< it has come, or is another one
        std::function<void(ObjectId node)> gone = {};
    };
    explicit DeclaredTable(Form form, Callbacks callbacks = {})
        : form_(std::move(form)), callbacks_(std::move(callbacks)), data_(form_.key) {}

    void follow(const Aspect& aspect, const ChangeList& list) { settle(aspect, data_.follow(aspect, list)); }
    void lookAnew(const Aspect& aspect) { settle(aspect, data_.lookAnew(aspect)); }
    /// Null where it has none. Holds until the next list.
    [[nodiscard]] const T* find(ObjectId node) const {
        const auto known = values_.find(node);
        return known == values_.end() ? nullptr : &known->second.second;
    }
    [[nodiscard]] std::size_t size() const { return values_.size(); }
    [[nodiscard]] ChangeList write(const Aspect& aspect, ObjectId node, const T& value) const {
        return data_.write(aspect, node, form_.encode(value));
    }
    [[nodiscard]] ChangeList erase(const Aspect& aspect, ObjectId node) const { return data_.erase(aspect, node); }

private:
    void settle(const Aspect& aspect, const std::set<ObjectId>& touched) {
        for (const ObjectId node : touched) {
            const ObjectId bearer = data_.bearerOf(node);
            const auto* core = bearer ? aspect.coreOf<ApplicationData>(*aspect.get<Node>(bearer)) : nullptr;
            std::optional<T> value = core ? form_.decode(core->data) : std::nullopt;
            if (!value) {
                if (values_.erase(node) > 0 && callbacks_.gone) callbacks_.gone(node);
                continue;
            }
            const auto known = values_.find(node);
            if (known != values_.end() && known->second.first == core->data) continue;
            const auto now = values_.insert_or_assign(node, std::pair(core->data, std::move(*value))).first;
            if (callbacks_.changed) callbacks_.changed(node, now->second.second);
        }
    }

    Form form_;
    Callbacks callbacks_;
    DeclaredData data_;
    std::unordered_map<ObjectId, std::pair<Blob, T>> values_;
};

}  // namespace tessera
