/// Typed data that an application keeps beside objects of a scene, in step with it.
///
///     SideTable<Score> scores({.created = [](ObjectId, const Object& o) { return o.is<Node>() ? std::optional(Score())
///     : std::nullopt; },
///                              .destroyed = [](ObjectId id, Score last) { … }});
///     application->onChanges([&](const ChangeList& list, Sequence) { scores.follow(application->scene(), list); });
#pragma once

#include <functional>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// Data of one type, for as many objects as have it: at most one for each. It stays here: nothing of it is in the
/// scene, its hash, a file or on the wire. (What is to travel is a field of a core: common/cores/README.md.) One thread
/// at a time.
///
/// A list costs a look-up per entry; callbacks come while `follow` runs, of each list first those of what was created,
/// then changed, then destroyed, each object once, in the order of the list. They may look at the scene, and attach and
/// detach; what they do is not called back.
template <typename T>
class SideTable {
public:
    struct Callbacks {
        /// Of every object that comes and has no data: what it gets; nothing: it gets none. Null: data is attached by
        /// hand alone.
        std::function<std::optional<T>(ObjectId, const Object&)> created = {};
        /// Of an object with data, of which a list writes a field, or which it places elsewhere.
        std::function<void(ObjectId, T&)> changed = {};
        /// Of an object with data that is no more. The data is yours.
        std::function<void(ObjectId, T)> destroyed = {};
        /// What `changed` is asked about: fields with one of these effects, and, with kStructure, placements.
        Effect effects = static_cast<Effect>(0xffff);
    };
    explicit SideTable(Callbacks callbacks = {}) : callbacks_(std::move(callbacks)) {}

    /// Replaces what it has.
    T& attach(ObjectId id, T data) { return data_.insert_or_assign(id, std::move(data)).first->second; }
    /// What it had; `destroyed` is not called.
    std::optional<T> detach(ObjectId id) {
        const auto node = data_.extract(id);
        return node.empty() ? std::nullopt : std::optional<T>(std::move(node.mapped()));
    }
    /// Null where it has none. Holds until its own data goes.
    [[nodiscard]] T* find(ObjectId id) {
        const auto known = data_.find(id);
        return known == data_.end() ? nullptr : &known->second;
    }
    [[nodiscard]] const T* find(ObjectId id) const { return const_cast<SideTable*>(this)->find(id); }
    [[nodiscard]] std::size_t size() const { return data_.size(); }

    /// After every list that was applied to the aspect.
    void follow(const Aspect& aspect, const ChangeList& list) {
        std::unordered_set<ObjectId> told;
        if (callbacks_.created)
            for (const Creation& creation : list.creations)
                if (come(aspect, creation.id)) told.insert(creation.id);
        if (data_.empty()) return;
        if (callbacks_.changed) change(list, told);
        for (const ObjectId id : list.destructions) go(id);
    }
    /// Before the first list, and after what is no list (another scene): what is not there goes, what is new comes, all
    /// others have changed.
    void lookAnew(const Aspect& aspect) {
        std::vector<ObjectId> gone, stay;
        for (const auto& [id, data] : data_) (aspect.find(id) ? stay : gone).push_back(id);
        if (callbacks_.created)
            for (const ObjectId id : aspect.ids()) come(aspect, id);
        if (callbacks_.changed)
            for (const ObjectId id : stay)
                if (T* data = find(id)) callbacks_.changed(id, *data);
        for (const ObjectId id : gone) go(id);
    }

private:
    bool come(const Aspect& aspect, ObjectId id) {
        const Object object = aspect.find(id);
        if (!object || data_.contains(id)) return false;
        std::optional<T> data = callbacks_.created(id, object);
        if (data) attach(id, std::move(*data));
        return data.has_value();
    }
    /// Who came with the list has been told already.
    void change(const ChangeList& list, std::unordered_set<ObjectId>& told) {
        const auto tell = [&](ObjectId id) {
            T* data = find(id);
            if (data && told.insert(id).second) callbacks_.changed(id, *data);
        };
        for (const FieldColumn& column : list.columns)
            if (effectsOf(column) & callbacks_.effects)
                for (const ObjectId id : column.ids) tell(id);
        for (const RangeEdit& range : list.ranges)
            if (effectsOf(range.type, range.field) & callbacks_.effects) tell(range.object);
        if (callbacks_.effects & Effect::kStructure)
            for (const Placement& placement : list.placements) tell(placement.node);
    }
    void go(ObjectId id) {
        std::optional<T> data = detach(id);
        if (data && callbacks_.destroyed) callbacks_.destroyed(id, std::move(*data));
    }

    Callbacks callbacks_;
    std::unordered_map<ObjectId, T> data_;
};

}  // namespace tessera
