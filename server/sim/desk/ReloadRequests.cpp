#include "server/sim/desk/ReloadRequests.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "common/base/Utf8.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

std::optional<FileInScene> FileInScene::of(const Preparation& made) {
    if (!made.held || !made.files) return std::nullopt;
    return FileInScene{.path = made.path,
                       .node = made.node,
                       .placing = made.placing,
                       .asked = made.asked,
                       .content = made.content,
                       .held = made.held,
                       .files = made.files};
}

ReloadRequests::ReloadRequests(const DeskSurroundings& around, OpenEdits& edits) : around_(around), edits_(edits) {
    if (!around.watchesFiles) return;
    watch_ = std::make_unique<FileWatch>(
        [this](std::uint64_t number, FileWatch::News news) {
            around_.deliver([this, number, news](TimePoint) { return changed(number, news); });
        },
        around_.lane, around_.time);
}

void ReloadRequests::say(const std::string& words, bool isWrong) const {
    if (around_.say) around_.say(words, isWrong);
}

void ReloadRequests::remember(FileInScene file) {
    // Of what an Inline holds, in place of what it held before.
    if (file.content)
        std::erase_if(files_, [&](const Files::value_type& entry) {
            const FileInScene& other = entry.second.file;
            const bool same = other.content && other.content->core == file.content->core && !entry.second.busy;
            if (same) bytes_ -= other.held->bytes;
            if (same && watch_) watch_->forget(entry.first);
            return same;
        });
    bytes_ += file.held->bytes;
    if (watch_) watch_->watch(next_, *file.files);
    files_.emplace(next_++, Known{.file = std::move(file)});
    forgetOldest();
}

void ReloadRequests::forgetOldest() {
    for (auto known = files_.begin(); files_.size() > 1 && (files_.size() > kMostFiles || bytes_ > kMostBytes);) {
        if (known == files_.end()) return;
        if (known->second.busy) {
            ++known;
            continue;
        }
        if (watch_ && stands(known->second.file))
            say(known->second.file.path + ": so many files are in the scene that this one is watched no more", true);
        known = forget(known);
    }
}

ReloadRequests::Files::iterator ReloadRequests::forget(Files::iterator known) {
    if (watch_) watch_->forget(known->first);
    bytes_ -= known->second.file.held->bytes;
    if (around_.uploads) around_.uploads->letGo({std::exchange(known->second.file.held, nullptr)});
    return files_.erase(known);
}

bool ReloadRequests::stands(const FileInScene& file) const {
    return std::ranges::any_of(file.held->tops, [&](std::uint32_t place) {
        return around_.simulation.scene().get<Node>(file.held->ids[place]) != nullptr;
    });
}

std::optional<ServerActions> ReloadRequests::ask(const Asker& asker, const std::string& path, ObjectId parent,
                                                 bool otherwise) {
    const auto isMeant = [&](const Files::value_type& entry) {
        const FileInScene& file = entry.second.file;
        return std::ranges::find(file.files->called, path) != file.files->called.end() && !file.content &&
               (!parent || parent == file.node) && stands(file);
    };
    auto found = files_.end();
    for (auto known = files_.begin(); known != files_.end(); ++known)
        if (isMeant(*known)) found = known;
    if (found == files_.end()) return std::nullopt;
    if (std::optional<Error> why = around_.whyNoEdit())
        return around_.answers().to(asker, tl::unexpected(*std::move(why)));
    Known& known = found->second;
    if (known.waiting.size() >= kMostWaiting)
        return around_.answers().to(asker, fail(ErrorCode::kLimit, "too many wait for this file already"));
    known.waiting.push_back(asker);
    known.otherwise = known.otherwise || otherwise;
    known.again = true;
    return known.busy ? ServerActions() : begin(found->first);
}

ServerActions ReloadRequests::changed(std::uint64_t number, FileWatch::News news) {
    const auto found = files_.find(number);
    if (found == files_.end()) return {};
    Known& known = found->second;
    if (news == FileWatch::News::kGone) {
        say(known.file.path + ": it is gone; what it held stays, and it is taken in again when it is back", true);
        return {};
    }
    // What people have removed they may bring back: it is looked for, and read once it stands there again.
    if (known.isFound && !stands(known.file)) {
        watch_->watch(number, *known.file.files, FileWatch::kGone);
        return {};
    }
    known.again = true;
    return known.busy ? ServerActions() : begin(number);
}

ServerActions ReloadRequests::begin(std::uint64_t number) {
    Known& known = files_.at(number);
    known.again = false;
    known.busy = true;
    known.tries = 0;
    known.askers = std::exchange(known.waiting, {});
    known.told = {.reloaded = true};
    const FileInScene& file = known.file;
    if (around_.loader.order({.ticket = edits_.newTicket(),
                              .node = file.node,
                              .path = file.path,
                              .placing = file.placing,
                              .asked = file.asked,
                              .content = file.content,
                              .file = number,
                              .former = known.isFound ? file.held : nullptr,
                              .watched = file.files}))
        return {};
    return end(number, Error{ErrorCode::kLimit, "too many files wait to be loaded already"}, true);
}

ServerActions ReloadRequests::read(Preparation made, TimePoint now) {
    const auto entry = files_.find(made.file);
    if (entry == files_.end()) return {};
    Known& known = entry->second;
    if (made.refused) return end(made.file, *made.refused, made.isShortage);
    known.change = std::move(made.change);
    known.files = std::move(made.files);
    if (!known.change) {
        const auto look = [this, number = made.file, held = made.held](const Aspect& scene, Sequence) -> WorkedOut {
            return withoutWord([this, number, held, objects = tessera::findAgain(scene, kRootNode, *held)] {
                found(number, held, objects);
            });
        };
        if (!around_.lookBeside) return look(around_.simulation.scene(), around_.simulation.sequence())(now);
        around_.lookBeside(look);
        return {};
    }
    known.told.objects = made.objects;
    known.told.triangles = made.triangles;
    known.told.notes = std::move(made.notes);
    return known.change->empty() ? end(made.file, std::nullopt) : plan(made.file, now);
}

void ReloadRequests::findAgain(const std::vector<std::string>& paths, const Placing& placing,
                               const std::string& begunWith) {
    if (begunWith != optionsText(placing))
        return say(
            "--reload: the scene was begun with another placing than this command says; its files are not watched",
            true);
    for (const std::string& path : paths) findAgain(path, placing);
}

void ReloadRequests::findAgain(const std::string& path, const Placing& placing) {
    const FileInScene file{.path = path,
                           .node = kRootNode,
                           .placing = placing,
                           .asked = false,
                           .held = std::make_shared<const HeldFile>(),
                           .files = std::make_shared<const WatchedFiles>()};
    Preparation order{.ticket = edits_.newTicket(),
                      .node = file.node,
                      .path = path,
                      .placing = placing,
                      .asked = false,
                      .file = next_,
                      .watched = file.files};
    if (!around_.loader.order(std::move(order)))
        return say(path + ": too many files wait to be loaded; it is not watched", true);
    files_.emplace(next_++, Known{.file = file, .busy = true, .isFound = false});
}

void ReloadRequests::found(std::uint64_t number, const std::shared_ptr<HeldFile>& held, std::size_t objects) {
    Known& known = files_.at(number);
    say(fmt::format("{}: {} of its {} objects are in the scene; what it changes from now on is taken in",
                    known.file.path, objects, held->ids.size()));
    bytes_ += held->bytes;
    known.file.held = held;
    known.isFound = true;
    known.file.files = std::exchange(known.files, nullptr);
    if (watch_) watch_->watch(number, *known.file.files);
    known.busy = false;
    forgetOldest();
}

ServerActions ReloadRequests::plan(std::uint64_t number, TimePoint now) {
    const Known& known = files_.at(number);
    const auto make = [change = known.change, below = known.file.node](const Aspect& scene) {
        return std::make_shared<Expected<ReloadPlan>>(planReload(scene, *change, below));
    };
    if (!around_.lookBeside) return planned(number, *make(around_.simulation.scene()), now);
    around_.lookBeside([this, number, make](const Aspect& scene, Sequence) -> WorkedOut {
        return [this, number, plan = make(scene)](TimePoint then) { return planned(number, std::move(*plan), then); };
    });
    return {};
}

ServerActions ReloadRequests::planned(std::uint64_t number, Expected<ReloadPlan> plan, TimePoint now) {
    if (!plan) return end(number, plan.error());
    Known& known = files_.at(number);
    const auto shared = std::make_shared<ReloadPlan>(std::move(*plan));
    if (shared->parts.empty()) return committed(number, shared, std::nullopt, now);
    std::vector<Blob> arrays = std::exchange(shared->arrays, {});
    const Asker asker = known.askers.empty() ? Asker() : known.askers.front();
    const auto given = [change = known.change, shared](ObjectId first) {
        for (std::size_t i = 0; i < shared->made.size(); ++i)
            change->next.ids[shared->made[i]] = ObjectId(first.value + i);
    };
    return edits_.enter(
        {.asker = asker,
         .edit = {.undoable = false, .ofFile = true},
         .isLoad = true,
         .loadedFrom = known.file.path,
         .since = now,
         .reload = shared,
         .given = given,
         .ended = [this, number, shared,
                   now](const std::optional<Error>& refused) { return committed(number, shared, refused, now); }},
        std::move(arrays), now);
}

void ReloadRequests::count(Known& known, const ReloadPlan& plan) const {
    answer::Loaded& told = known.told;
    told.changed += plan.changed;
    told.created += plan.objects;
    told.removed += plan.removed;
    told.kept += plan.kept;
    told.notes.insert(told.notes.begin(), plan.notes.begin(), plan.notes.end());
}

ServerActions ReloadRequests::committed(std::uint64_t number, const std::shared_ptr<ReloadPlan>& plan,
                                        const std::optional<Error>& refused, TimePoint now) {
    constexpr int kTries = 4;
    Known& known = files_.at(number);
    if (!refused) {
        count(known, *plan);
        known.change->next = heldAfter(std::move(known.change->next), *plan);
        return end(number, std::nullopt);
    }
    // Somebody has removed or put something in between; what has been made stays known. A person's cancelling (kFailed)
    // is the end.
    const bool mayFit = refused->code != ErrorCode::kFailed && !around_.whyNoEdit();
    if (mayFit && ++known.tries < kTries) return this->plan(number, now);
    return end(number, refused);
}

ServerActions ReloadRequests::end(std::uint64_t number, const std::optional<Error>& refused, bool isShortage) {
    constexpr std::size_t kMostNoteBytes = 500;
    Known& known = files_.at(number);
    FileInScene& file = known.file;
    answer::Loaded& told = known.told;
    const auto named = [&](const std::string& why) {
        return why.starts_with(file.path) ? why : fmt::format("{}: {}", file.path, why);
    };
    if (refused) {
        std::string words = named(refused->message);
        if (words != known.said) say(words + "; what it held before stays", true);
        known.said = std::move(words);
        // A change for which the machine had no room is one still: it comes in once there is some.
        if (isShortage && watch_) watch_->again(number);
    } else {
        known.said.clear();
        if (told.changed + told.created + told.removed + told.kept > 0) {
            say(fmt::format(
                "{}: taken in again: {} values changed, {} objects made, {} removed, {} values kept as they are here",
                file.path, told.changed, told.created, told.removed, told.kept));
            for (const std::string& note : told.notes) say(named(note));
        }
    }
    // A change of which nothing came is one still, the next time.
    if (!refused) {
        std::vector<std::shared_ptr<const void>> old = {file.held, known.change};
        bytes_ -= file.held->bytes;
        file.held = std::make_shared<const HeldFile>(std::move(known.change->next));
        bytes_ += file.held->bytes;
        file.files = std::move(known.files);
        if (watch_) watch_->watch(number, *file.files);
        known.change.reset();
        if (around_.uploads) around_.uploads->letGo(std::move(old));
    }
    known.change.reset();
    known.busy = false;

    ServerActions actions;
    if (const auto top = std::ranges::find_if(
            file.held->tops,
            [&](std::uint32_t place) { return around_.simulation.scene().get<Node>(file.held->ids[place]); });
        top != file.held->tops.end())
        told.node = file.held->ids[*top];
    if (std::exchange(known.otherwise, false))
        told.notes.insert(told.notes.begin(),
                          "it stands as it was loaded: what else was said of that is of no use with a reload");
    if (told.notes.size() > answer::Loaded::kMostNotes) told.notes.resize(answer::Loaded::kMostNotes);
    for (std::string& note : told.notes) note = cutUtf8(note, kMostNoteBytes);
    const auto answer = [&]() -> Expected<ApplicationAnswer> {
        if (refused) return fail(refused->code, named(refused->message));
        if (!told.node && !file.held->tops.empty())
            return fail(ErrorCode::kNotFound, named("nothing of it is in the scene any more; load it anew"));
        return told;
    }();
    for (const Asker& asker : std::exchange(known.askers, {})) append(actions, around_.answers().to(asker, answer));
    if (known.again) append(actions, begin(number));
    forgetOldest();
    return actions;
}

}  // namespace tessera
