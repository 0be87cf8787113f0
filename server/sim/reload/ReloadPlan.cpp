#include "server/sim/reload/ReloadPlan.h"

#include <algorithm>
#include <deque>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/cores/Node.h"
#include "common/cores/Skin.h"
#include "common/scene/WrittenByServer.h"
#include "server/sim/frame/InlineContents.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/reload/ChildOrder.h"
#include "server/sim/reload/FileNames.h"

namespace tessera {
namespace {

bool hasArrays(const TypeInfo& type) {
    return std::ranges::find(type.fields, FieldKind::kBlob, &FieldEntry::kind) != type.fields.end();
}

std::size_t bytesOf(const FieldValue& value) {
    if (const auto* text = std::get_if<std::string>(&value)) return 8 + text->size();
    if (const auto* refs = std::get_if<RefList>(&value)) return 8 + 8 * refs->size();
    return std::holds_alternative<Matrix>(value) ? 8 + sizeof(Matrix) : 40;
}

/// Nobody's word: written anew whenever what it follows from moves.
bool followsOthers(ObjectType type, FieldId field) {
    return type == typeOf<Skin>() && field == fieldId<&Skin::pose>;
}

class Planner {
    static constexpr std::uint32_t kNone = FileObjects::kNone;

public:
    Planner(const Aspect& scene, const FileChange& change, ObjectId below, const ReloadPlan::Limits& limits)
        : scene_(scene),
          change_(change),
          after_(change.after),
          below_(below),
          limits_(limits),
          states_(after_.count()),
          made_(after_.count()),
          wanted_(after_.count()),
          names_(after_),
          formerNames_(change.before) {}

    ReloadPlan run() {
        findStates();
        decideRows();
        // What is to be made may refer to more of it: the plan's list grows while it is looked at.
        for (std::size_t i = 0; i < plan_.made.size(); ++i)
            after_.forEachRef(plan_.made[i], [this](std::uint32_t to) { touch(to); });
        decideRemovals();
        plan_.objects = plan_.made.size();
        write();
        writeWhatWaits();
        if (moreNotes_ > 0) plan_.notes.push_back(fmt::format("and {} more", moreNotes_));
        return std::move(plan_);
    }

private:
    static constexpr std::size_t kFewWaiting = 1'000;

    enum class State : std::uint8_t { kThere, kGone, kNew, kLeftOut };

    struct Row {
        ObjectId id;
        const TypeInfo* type = nullptr;
        const FieldEntry* field = nullptr;
        FieldValue was, is;
    };

    void note(std::string text) {
        if (plan_.notes.size() < ReloadPlan::kMostNotes)
            plan_.notes.push_back(std::move(text));
        else
            ++moreNotes_;
    }

    [[nodiscard]] bool isThere(ObjectId id, const TypeInfo& type) const {
        const Object object = id ? scene_.find(id) : Object();
        return object && object.info().index == type.index;
    }

    void findStates() {
        for (std::uint32_t b = 0; b < after_.count(); ++b) {
            const ObjectId id = change_.next.ids[b];
            if (isThere(id, after_.type(b)))
                states_[b] = State::kThere;
            else
                states_[b] = id || change_.formerOf[b] != kNone ? State::kGone : State::kNew;
        }
        // Parents come before their children.
        std::deque<std::uint32_t> open(1, after_.count());
        for (; !open.empty(); open.pop_front()) {
            const std::uint32_t above = open.front();
            const bool standsThere = above == after_.count() || states_[above] == State::kThere || made_[above];
            for (const std::uint32_t node : after_.children(above)) {
                open.push_back(node);
                if (states_[node] != State::kNew) continue;
                if (standsThere) {
                    make(node);
                    continue;
                }
                states_[node] = State::kLeftOut;
                plan_.leftOut.push_back(node);
                if (above < after_.count() && states_[above] == State::kGone)
                    note(fmt::format("{} is new in the file, below what was removed here", names_.of(node)));
            }
        }
    }

    void make(std::uint32_t place) {
        made_[place] = ObjectId(kFirstPlaceholder + plan_.made.size());
        plan_.made.push_back(place);
    }
    /// Something refers to it. What is no node comes, and comes back, with whoever needs it.
    void touch(std::uint32_t place) {
        wanted_[place] = true;
        if (states_[place] != State::kThere && !made_[place] && !after_.isNode(place)) make(place);
    }
    /// None: it is not there, and does not come.
    [[nodiscard]] ObjectId idOf(std::uint32_t place) const {
        return states_[place] == State::kThere ? change_.next.ids[place] : made_[place];
    }

    /// Of the file as it is.
    [[nodiscard]] FieldValue withIds(FieldValue value) const {
        const auto given = [this](ObjectId id) {
            const std::uint32_t place = after_.placeOf(id);
            return place == kNone ? id : idOf(place);
        };
        return replaced(std::move(value), given);
    }
    /// Of the file as it was.
    [[nodiscard]] FieldValue withFormerIds(FieldValue value) const {
        const auto given = [this](ObjectId id) {
            const std::uint32_t place = change_.before.placeOf(id);
            return place == kNone ? id : change_.former->ids[place];
        };
        return replaced(std::move(value), given);
    }
    template <typename Given>
    static FieldValue replaced(FieldValue value, Given&& given) {
        if (auto* ref = std::get_if<ObjectId>(&value)) *ref = *ref ? given(*ref) : *ref;
        if (auto* refs = std::get_if<RefList>(&value)) {
            for (ObjectId& id : *refs) id = given(id);
            std::erase(*refs, ObjectId());
        }
        return value;
    }
    void touchAll(const FieldValue& value) {
        const auto look = [this](ObjectId id) {
            if (const std::uint32_t place = after_.placeOf(id); place != kNone) touch(place);
        };
        if (const auto* ref = std::get_if<ObjectId>(&value)) look(*ref);
        if (const auto* refs = std::get_if<RefList>(&value)) std::ranges::for_each(*refs, look);
    }

    void decideRows() {
        const std::vector<FileChange::Row>& rows = change_.rows;
        for (std::size_t first = 0, last = 0; first < rows.size(); first = last) {
            while (last < rows.size() && rows[last].object == rows[first].object) ++last;
            decideRowsOf(std::span(rows).subspan(first, last - first));
        }
    }

    void decideRowsOf(std::span<const FileChange::Row> rows) {
        const std::uint32_t place = rows.front().object;
        if (states_[place] != State::kThere) {
            if (after_.isNode(place)) note(fmt::format("{} was removed here, and stays so", names_.of(place)));
            if (states_[place] == State::kGone && change_.next.ids[place])
                for (const FileChange::Row& row : rows) waiting_.push_back(&row);
            return;
        }
        const ObjectId id = change_.next.ids[place];
        const Object object = scene_.find(id);
        const TypeInfo& type = object.info();
        std::vector<const FileChange::Row*> writes, keeps;
        for (const FileChange::Row& row : rows) {
            if (fieldOfServer(type.type, row.field->id)) continue;
            const FieldValue now = row.field->load(object);
            if (followsOthers(type.type, row.field->id)) {
                rows_.push_back({id, &type, row.field, now, row.is});
                continue;
            }
            if (areSame(*row.field, now, withFormerIds(row.was)))
                writes.push_back(&row);
            else if (!areSame(*row.field, now, withIds(row.is)))
                keeps.push_back(&row);
        }
        if (!keeps.empty() && hasArrays(type)) {
            keeps.insert(keeps.end(), writes.begin(), writes.end());
            writes.clear();
        }
        for (const FileChange::Row* row : keeps)
            note(fmt::format("{}: {} stays as it is here; the file has changed it too", names_.of(place),
                             row->field->name));
        plan_.kept += keeps.size();
        for (const FileChange::Row* row : writes) {
            touchAll(row->is);
            rows_.push_back({id, &type, row->field, withFormerIds(row->was), row->is});
        }
        plan_.changed += writes.size();
    }

    // ---- what the file has no more

    void decideRemovals() {
        const FileObjects& before = change_.before;
        std::vector<ObjectId> order;
        for (std::uint32_t a = 0; a < before.count(); ++a)
            if (const ObjectId id = change_.former->ids[a]; change_.vanished[a] && isThere(id, before.type(a))) {
                going_.emplace(id, a);
                order.push_back(id);
            }
        // And what the file still has, but only for who does not come.
        std::vector<std::uint32_t> nextOf(before.count(), kNone);
        for (std::uint32_t b = 0; b < after_.count(); ++b)
            if (change_.formerOf[b] != kNone) nextOf[change_.formerOf[b]] = b;
        const auto look = [&](std::uint32_t to) {
            const ObjectId id = change_.former->ids[to];
            if (before.isNode(to) || nextOf[to] == kNone || wanted_[nextOf[to]] || !isThere(id, before.type(to)))
                return;
            if (going_.emplace(id, to).second) order.push_back(id);
        };
        const auto offer = [&](ObjectId id) {
            if (const std::uint32_t place = before.placeOf(id); place != kNone) look(place);
        };
        for (const FileChange::Row& row : change_.rows) {
            if (const auto* ref = std::get_if<ObjectId>(&row.was)) offer(*ref);
            if (const auto* refs = std::get_if<RefList>(&row.was))
                for (const ObjectId id : *refs) offer(id);
        }
        for (std::size_t i = 0; i < order.size(); ++i) before.forEachRef(going_.at(order[i]), look);
        std::unordered_map<ObjectId, std::size_t> usesGoing;
        const auto countRefs = [&](const FieldValue& value) {
            if (const auto* ref = std::get_if<ObjectId>(&value)) ++usesGoing[*ref];
            if (const auto* refs = std::get_if<RefList>(&value))
                for (const ObjectId id : *refs) ++usesGoing[id];
        };
        for (const Row& row : rows_) countRefs(row.was);
        for (const ObjectId id : order) forEachRef(scene_.find(id), [&](ObjectId to) { ++usesGoing[to]; });
        std::deque<ObjectId> open(order.begin(), order.end());
        for (; !open.empty(); open.pop_front()) {
            const ObjectId id = open.front();
            if (!going_.contains(id)) continue;
            const bool used = usesGoing[id] < scene_.useCount(id);
            if (!used && !bearsOthers(id)) continue;
            const std::uint32_t place = going_.at(id);
            if (before.isNode(place))
                note(fmt::format("{} is not in the file any more, and stays: {}", formerNames_.of(place),
                                 used ? "something here names it" : "something here is below it"));
            going_.erase(id);
            forEachRef(scene_.find(id), [&](ObjectId to) {
                --usesGoing[to];
                open.push_back(to);
            });
            if (const Node* node = scene_.get<Node>(id)) open.push_back(node->parent);
        }
        std::erase_if(order, [this](ObjectId id) { return !going_.contains(id); });
        for (const ObjectId id : order) nameWhatWasChanged(id, going_.at(id));
        plan_.removed = order.size();
        sortUsersFirst(std::move(order));
    }

    /// Children that stay. What the server hangs there, and what an Inline holds, goes by itself.
    [[nodiscard]] bool bearsOthers(ObjectId id) const {
        const Node* node = scene_.get<Node>(id);
        if (!node) return false;
        if (const std::optional<LoadWish> wish = node->core ? loadWishOf(scene_.find(node->core)) : std::nullopt)
            if (wish->state == LoadWords::kThere) return false;
        return std::ranges::any_of(node->children, [this](ObjectId child) {
            return !going_.contains(child) && !scene_.get<Node>(child)->ofServer;
        });
    }

    void nameWhatWasChanged(ObjectId id, std::uint32_t place) {
        const Object object = scene_.find(id);
        for (const FieldEntry& field : object.info().fields) {
            if (fieldOfServer(object.info().type, field.id)) continue;
            if (areSame(field, field.load(object), withFormerIds(change_.before.value(place, field)))) continue;
            note(fmt::format("{} has gone with the file; its {} had been changed here", formerNames_.of(place),
                             field.name));
            return;
        }
    }

    /// So that they can go in several lists. What stands in a circle comes last.
    void sortUsersFirst(std::vector<ObjectId> order) {
        std::unordered_map<ObjectId, std::size_t> uses;
        const auto eachUsed = [&](ObjectId id, auto&& visit) {
            forEachRef(scene_.find(id), [&](ObjectId to) {
                if (going_.contains(to)) visit(to);
            });
            if (const Node* node = scene_.get<Node>(id); node && going_.contains(node->parent)) visit(node->parent);
        };
        for (const ObjectId id : order) eachUsed(id, [&](ObjectId to) { ++uses[to]; });
        for (const ObjectId id : order)
            if (uses[id] == 0) goers_.push_back(id);
        for (std::size_t i = 0; i < goers_.size(); ++i)
            eachUsed(goers_[i], [&](ObjectId to) {
                if (--uses[to] == 0) goers_.push_back(to);
            });
        inCircles_ = order.size() - goers_.size();
        for (const ObjectId id : order)
            if (uses[id] != 0) goers_.push_back(id);
    }

    // ---- what waits

    /// With places in the file as it is; those that it has no more are behind them.
    void writeWhatWaits() {
        const FileObjects& before = change_.before;
        std::vector<std::uint32_t> gone;
        // Those that have waited longest are behind all others. No more of them than a file has itself: who brings
        // them back after so long finds them as they were.
        const std::size_t most = std::max<std::size_t>(kFewWaiting, after_.count());
        for (std::uint32_t a = 0; a < before.count() && gone.size() < most; ++a) {
            const ObjectId id = change_.former->ids[a];
            if (!change_.vanished[a] || !id || isThere(id, before.type(a))) continue;
            gone.push_back(a);
            plan_.idsWaiting.push_back(id);
        }
        if (waiting_.empty() && gone.empty()) return;
        std::vector<std::uint32_t> nextOf(before.count(), kNone);
        for (std::uint32_t b = 0; b < after_.count(); ++b)
            if (change_.formerOf[b] != kNone) nextOf[change_.formerOf[b]] = b;
        for (std::size_t i = 0; i < gone.size(); ++i) nextOf[gone[i]] = after_.count() + static_cast<std::uint32_t>(i);
        const auto placeholder = [](std::uint32_t place) { return ObjectId(kFirstPlaceholder + place); };
        const auto asNext = [&](FieldValue value) {
            return replaced(std::move(value), [&](ObjectId id) {
                const std::uint32_t place = before.placeOf(id);
                if (place == kNone) return id;
                return nextOf[place] == kNone ? change_.former->ids[place] : placeholder(nextOf[place]);
            });
        };
        ChangeListBuilder list;
        for (const FileChange::Row* row : waiting_)
            if (!made_[row->object])  // else it has come as the file has it, for the sake of another
                list.set(placeholder(row->object), after_.type(row->object).type, row->field->id, asNext(row->was));
        for (const std::uint32_t a : gone) {
            const TypeInfo& type = before.type(a);
            list.create(placeholder(nextOf[a]), type.type);
            for (const FieldEntry& field : type.fields)
                if (FieldValue value = before.value(a, field); value != field.load(type.freshObject()))
                    list.set(placeholder(nextOf[a]), type.type, field.id, asNext(std::move(value)));
        }
        plan_.waits = list.take();
    }

    // ---- the lists

    void write() {
        const std::size_t size = rows_.size() + plan_.made.size() * 4 + goers_.size() * 2;
        const bool whole = size <= limits_.whole && bytesOfAll() <= limits_.whole * 128;
        if (plan_.made.empty() && rows_.empty() && goers_.empty() && change_.reordered.empty()) return;
        ChangeListBuilder makes;
        for (const std::uint32_t place : plan_.made) writeNew(makes, place);
        for (const std::uint32_t place : plan_.made)
            if (after_.isNode(place)) placeNew(makes, place, whole);
        if (!whole && !plan_.made.empty()) {
            ChangeList list = makes.take();
            plan_.arrays = blobsOf(list);
            for (ChangeList& part : cutForFrames(std::move(list))) plan_.parts.push_back({std::move(part), {}});
            plan_.creating = plan_.parts.size();
        }
        open_ = std::move(makes);
        writeRest(whole);
        close();
    }

    [[nodiscard]] std::size_t bytesOfAll() const {
        std::size_t bytes = 0;
        for (const Row& row : rows_) bytes += bytesOf(row.is);
        return bytes;
    }

    void writeNew(ChangeListBuilder& list, std::uint32_t place) const {
        const TypeInfo& type = after_.type(place);
        list.create(made_[place], type.type);
        for (const FieldEntry& field : type.fields) {
            FieldValue value = withIds(after_.value(place, field));
            if (value != field.load(type.freshObject())) list.set(made_[place], type.type, field.id, value);
        }
    }

    void placeNew(ChangeListBuilder& list, std::uint32_t node, bool whole) const {
        const std::uint32_t above = after_.parent(node);
        if (above != kNone && made_[above])
            list.place(made_[node], made_[above]);
        else if (!whole)
            list.place(made_[node], above == kNone ? below_ : change_.next.ids[above]);
    }

    void writeRest(bool whole) {
        for (const ObjectId id : goers_)
            if (const Node* node = scene_.get<Node>(id); node && !going_.contains(node->parent)) {
                open_.detach(id);
                took(40, whole);
            }
        for (const std::uint32_t above : change_.reordered) {
            if (above < after_.count() && states_[above] != State::kThere) continue;
            const ObjectId parent = above == after_.count() ? below_ : change_.next.ids[above];
            std::vector<OrderedChild> wanted;
            for (const std::uint32_t child : after_.children(above))
                if (const ObjectId id = idOf(child)) wanted.push_back({id, wasAt(child)});
            const auto goes = [this](ObjectId id) { return going_.contains(id); };
            for (const Placement& placement : childOrder(scene_.get<Node>(parent)->children, wanted, parent, goes)) {
                open_.place(placement.node, placement.parent, placement.index);
                took(40,
                     whole || changes_ < 4 * limits_.changes);  // what is out of its place comes back in the same frame
            }
            took(0, whole);
        }
        const ObjectId* last = nullptr;
        for (const Row& row : rows_) {
            if (going_.contains(row.id)) continue;
            if (last && *last != row.id) took(0, whole);
            last = &row.id;
            FieldValue is = withIds(row.is);
            if (!whole)
                if (const auto* array = std::get_if<Blob>(&is); array && !array->empty())
                    plan_.arrays.push_back(*array);
            bytes_ += bytesOf(is);
            ++changes_;
            open_.set(row.id, row.type->type, row.field->id, is);
            before_.set(row.id, row.type->type, row.field->id, row.was);
        }
        took(0, whole);
        for (std::size_t i = 0; i < goers_.size(); ++i) {
            const Node* node = scene_.get<Node>(goers_[i]);
            if (node && going_.contains(node->parent)) open_.detach(goers_[i]);
            open_.destroy(goers_[i]);
            took(64, whole || i + inCircles_ + 1 > goers_.size());
        }
    }

    [[nodiscard]] std::int64_t wasAt(std::uint32_t child) const {
        if (made_[child]) return OrderedChild::kNew;
        const std::uint32_t former = change_.formerOf[child];
        return former == kNone ? OrderedChild::kStays : std::int64_t{change_.siblingsBefore[former]};
    }

    /// Something has been written, and all that belongs together.
    void took(std::size_t bytes, bool goesOn) {
        bytes_ += bytes;
        changes_ += bytes > 0 ? 1 : 0;
        if (!goesOn && (changes_ >= limits_.changes || bytes_ >= limits_.bytes)) close();
    }

    void close() {
        ReloadPlan::Part part{.list = open_.take(), .before = before_.take()};
        changes_ = bytes_ = 0;
        if (part.list.empty()) return;
        if (plan_.creating == 0 && plan_.parts.empty()) plan_.arrays = blobsOf(part.list);
        plan_.parts.push_back(std::move(part));
    }

    const Aspect& scene_;
    const FileChange& change_;
    const FileObjects& after_;
    const ObjectId below_;
    const ReloadPlan::Limits limits_;
    std::vector<State> states_;
    std::vector<ObjectId> made_;  ///< by place: placeholders of the plan; none: it is not made
    std::vector<bool> wanted_;    ///< by place: what is written refers to it
    FileNames names_, formerNames_;
    std::vector<Row> rows_;
    std::vector<const FileChange::Row*> waiting_;        ///< values of what was removed here
    std::unordered_map<ObjectId, std::uint32_t> going_;  ///< and their places in the former file
    std::vector<ObjectId> goers_;
    std::size_t inCircles_ = 0;  ///< of them, the last ones
    ReloadPlan plan_;
    std::uint64_t moreNotes_ = 0;
    ChangeListBuilder open_, before_;
    std::size_t changes_ = 0, bytes_ = 0;
};

}  // namespace

Expected<ReloadPlan> planReload(const Aspect& scene, const FileChange& change, ObjectId below,
                                const ReloadPlan::Limits& limits) {
    if (!scene.get<Node>(below))
        return fail(ErrorCode::kNotFound, "the node that it was loaded below has been removed");
    return Planner(scene, change, below, limits).run();
}

HeldFile heldAfter(HeldFile next, const ReloadPlan& plan) {
    next.leftOut = plan.leftOut;
    if (!plan.waits.empty()) next.write(plan.waits, plan.idsWaiting);
    return next;
}

/// Rows of what is there come last in a column, in the order of `before`.
void leaveOutWhatChanged(const Aspect& scene, ReloadPlan::Part& part, ReloadPlan& plan) {
    const auto columnFor = [&](const FieldColumn& before) -> FieldColumn& {
        const auto is = [&](const FieldColumn& column) {
            return column.type == before.type && column.field == before.field;
        };
        return *std::ranges::find_if(part.list.columns, is);
    };
    std::unordered_set<ObjectId> whole;  // of types with arrays
    std::vector<std::vector<bool>> leaves(part.before.columns.size());
    bool any = false;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        const FieldColumn& before = part.before.columns[i];
        const TypeInfo& type = *findType(before.type);
        const FieldEntry& field = *findField(type, before.field);
        leaves[i].resize(before.ids.size());
        for (std::size_t row = 0; row < before.ids.size(); ++row) {
            const Object object = scene.find(before.ids[row]);
            const bool same =
                object && object.info().index == type.index &&
                (followsOthers(before.type, before.field) || areSame(field, field.load(object), before.value(row)));
            if (same) continue;
            leaves[i][row] = any = true;
            if (hasArrays(type)) whole.insert(before.ids[row]);
        }
    }
    if (!any) return;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        const FieldColumn& before = part.before.columns[i];
        FieldColumn& column = columnFor(before);
        FieldColumn rest = FieldColumn::ofShape(column.type, column.field, column.kind(), column.width);
        const std::size_t added = column.ids.size() - before.ids.size();
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const bool left = row >= added && (leaves[i][row - added] || whole.contains(column.ids[row]));
            if (!left) rest.append(column.ids[row], column.value(row));
            plan.kept += left ? 1 : 0;
            plan.changed -= left ? 1 : 0;
        }
        column = std::move(rest);
    }
    std::erase_if(part.list.columns, [](const FieldColumn& column) { return column.ids.empty(); });
    if (plan.notes.size() < ReloadPlan::kMostNotes + 2)
        plan.notes.emplace_back("some of it was changed here while the file was read, and stays so");
}

}  // namespace tessera
