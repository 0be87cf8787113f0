#include "client/ctl/Verbs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>

#include "client/ctl/AccessVerbs.h"
#include "client/ctl/AnimationVerbs.h"
#include "client/ctl/CollisionVerbs.h"
#include "client/ctl/FieldText.h"
#include "client/ctl/FileVerbs.h"
#include "client/ctl/FlyTerminal.h"
#include "client/ctl/InlineVerbs.h"
#include "client/ctl/LiveVerbs.h"
#include "client/ctl/LoadVerbs.h"
#include "client/ctl/MaterialVerbs.h"
#include "client/ctl/MeasureVerbs.h"
#include "client/ctl/NewWall.h"
#include "client/ctl/PlayTracker.h"
#include "client/ctl/SceneNames.h"
#include "client/ctl/SceneTree.h"
#include "client/ctl/SearchVerbs.h"
#include "client/ctl/TrackingVerbs.h"
#include "client/ctl/ViewVerbs.h"
#include "common/access/LocalWalls.h"
#include "common/base/NewFile.h"
#include "common/cores/Transform.h"
#include "common/image/Picture.h"
#include "common/mosaic/Mosaic.h"
#include "common/scenefile/SceneFile.h"

namespace tessera {

namespace {

using Json = nlohmann::ordered_json;

/// Where these transforms stand in the tree; the number of one that nobody holds any more.
std::vector<std::string> placesOf(Application& application, std::span<const ObjectId> transforms) {
    std::vector<std::string> places;
    const Expected<std::vector<ObjectId>> nodes = nodesHolding(application, transforms);
    SceneNames names(application);
    if (nodes) names.learn(*nodes);
    if (nodes)
        for (const ObjectId node : *nodes) places.push_back(names.node(node));
    if (places.empty())
        for (const ObjectId transform : transforms) places.push_back(numberOf(transform));
    return places;
}

Answer committedAnswer(Application& application, const answer::Committed& committed, std::string done) {
    const std::vector<std::string> stopped = placesOf(application, committed.stopped);
    Answer answer;
    answer.text = std::move(done) + fmt::format(" (change {})\n", committed.sequence.value);
    answer.json = {{"sequence", committed.sequence.value}, {"stopped", stopped}};
    if (stopped.empty()) return answer;
    Answer met = whatStopped(application, committed.stopped);
    if (met.text.empty())
        for (const std::string& name : stopped)
            met.text += fmt::format(
                "{} was stopped: by what it hit (see contacts), or because it cannot be so (a scale of zero or through "
                "zero, a number too large)\n",
                name);
    answer.text += met.text;
    answer.json["stopped_by"] = std::move(met.json);
    return answer;
}

Expected<Answer> run(Application& application, const verb::Status&) {
    const Expected<answer::Status> status = application.status();
    if (!status) return tl::unexpected(status.error());
    Answer answer;
    answer.text = fmt::format("wall    {}, frame {}, change {}, epoch {}\n", status->wallName, status->frame.value,
                              status->sequence.value, status->epoch.value);
    Json hosts = Json::array();
    std::size_t widest = 0;
    for (const answer::HostInfo& host : status->hosts) widest = std::max(widest, host.name.size());
    for (const answer::HostInfo& host : status->hosts) {
        answer.text += fmt::format("host    {:<{}}  {:<8} frame {}, round trip {:.3f} ms\n", host.name, widest,
                                   host.state, host.lastShown.value, host.roundTripMs);
        hosts.push_back({{"name", host.name},
                         {"state", host.state},
                         {"last_shown", host.lastShown.value},
                         {"round_trip_ms", host.roundTripMs}});
    }
    if (!status->waitingFor.empty())
        answer.text += fmt::format("waiting for {}\n", fmt::join(status->waitingFor, ", "));
    Json waits = Json::array();
    for (const answer::TileWait& wait : status->waits) {
        const double each = wait.ms / static_cast<double>(std::max<std::uint64_t>(1, wait.frames));
        answer.text += fmt::format("waits   {} of host {} in {} of {} frames, {:.1f} ms each: {}\n", wait.tile,
                                   wait.host, wait.frames, status->waitFrames, each, wait.reason);
        waits.push_back({{"tile", wait.tile},
                         {"host", wait.host},
                         {"frames", wait.frames},
                         {"ms", wait.ms},
                         {"reason", wait.reason}});
    }
    answer.text += fmt::format("scene   {} objects, {} nodes, state {}\n", status->objects, status->nodes,
                               toHex(status->stateHash));
    answer.text += fmt::format("undo    {} changes\nredo    {} changes\napplications  {}\n", status->undoDepth,
                               status->redoDepth, status->applications);
    answer.text += status->navigation.empty()
                       ? std::string("flown   not here: the server takes no input\n")
                       : fmt::format("flown   {}{}{}\n", status->navigation, status->steering.empty() ? "" : ", by ",
                                     fmt::join(status->steering, ", "));
    if (status->budgetMs > 0) answer.text += fmt::format("budget  {}\n", budgetText(*status));
    if (!status->journal.empty())
        answer.text += fmt::format("journal {}{}{}\n", status->journal, status->journalTrouble.empty() ? "" : ": ",
                                   status->journalTrouble);
    for (const std::string& line : status->trackers) answer.text += fmt::format("tracker {}\n", line);
    for (const std::string& line : status->programs) answer.text += fmt::format("program {}\n", line);
    for (const std::string& line : status->keys) answer.text += fmt::format("{}\n", line);
    answer.json = {{"wall", status->wallName},
                   {"epoch", status->epoch.value},
                   {"frame", status->frame.value},
                   {"sequence", status->sequence.value},
                   {"state_hash", toHex(status->stateHash)},
                   {"hosts", std::move(hosts)},
                   {"waiting_for", status->waitingFor},
                   {"waits", std::move(waits)},
                   {"wait_frames", status->waitFrames},
                   {"objects", status->objects},
                   {"nodes", status->nodes},
                   {"undo_depth", status->undoDepth},
                   {"redo_depth", status->redoDepth},
                   {"applications", status->applications},
                   {"navigation", status->navigation},
                   {"steering", status->steering},
                   {"budget_ms", status->budgetMs},
                   {"detail", status->detail},
                   {"programs", status->programs},
                   {"keys", status->keys},
                   {"key_days", status->keyDays},
                   {"journal", status->journal},
                   {"journal_trouble", status->journalTrouble},
                   {"trackers", status->trackers}};
    return answer;
}

Expected<Answer> run(Application& application, const verb::Tree& tree, bool json) {
    const Expected<ObjectInfo> top = application.describeNode(tree.node);
    if (!top) return tl::unexpected(top.error());
    TreeWish wanted{.node = top->id};
    if (tree.depth >= 0) wanted.levels = static_cast<std::uint32_t>(tree.depth);
    const Expected<SceneExcerpt> told = application.fetchTree(wanted);
    if (!told) return tl::unexpected(told.error());
    if (!told->get<Node>(top->id)) return fail(ErrorCode::kNotFound, fmt::format("{} is gone", top->path));
    // Of a large tree either is long.
    if (json) return Answer{{}, treeJson(*told, top->id, top->path, tree.depth), {}};
    return Answer{treeText(*told, top->id, tree.depth), {}, {}};
}

Expected<Answer> run(Application& application, const verb::Move& move) {
    const Expected<ObjectInfo> node = application.describeNode(move.node);
    if (!node) return tl::unexpected(node.error());
    const Expected<answer::Committed> committed = application.moveNode(*node, move.move);
    if (!committed) return tl::unexpected(committed.error());
    SceneNames names(application);
    names.learn(std::span(&node->movable, 1));
    const std::string path = names.node(node->movable);
    Answer answer = committedAnswer(application, *committed, fmt::format("moved {}", path));
    const Expected<SceneExcerpt> now = application.fetch(std::span(&node->movable, 1));
    const Transform* transform = now ? now->coreOf(node->movable).as<Transform>() : nullptr;
    if (transform == nullptr) return answer;  // somebody removed it meanwhile
    answer.json["node"] = node->movable.value;
    answer.json["path"] = path;
    answer.json["translation"] = jsonOf(transform->translation);
    answer.json["rotation"] = Json::array(
        {transform->rotation.w(), transform->rotation.x(), transform->rotation.y(), transform->rotation.z()});
    answer.json["scale"] = jsonOf(transform->scale);
    answer.text += fmt::format("it is at {} now\n", textOf(transform->translation));
    return answer;
}

Expected<Answer> setElements(Application& application, const ObjectInfo& object, const FieldPlace& place,
                             const ArrayPart& part, const std::vector<std::string>& words) {
    const Expected<Blob> elements = parseElements(*place.field, words);
    if (!elements) return tl::unexpected(elements.error());
    ChangeListBuilder edits;
    edits.setRange(place.object, place.type->type, place.field->id, part.first * place.field->elementBytes(),
                   *elements);
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    SceneNames names(application);
    names.learn(std::span(&object.id, 1));
    return committedAnswer(application, *committed,
                           fmt::format("{} of {}: {} from {} on {} set", part.field, names.node(object.id),
                                       words.size() / place.field->numbersEach, part.first,
                                       committed->stopped.empty() ? "are" : "were to be"));
}

Expected<Answer> run(Application& application, const verb::Set& set) {
    const Expected<ObjectInfo> object = application.describe(set.node);
    if (!object) return tl::unexpected(object.error());
    const Expected<std::optional<ArrayPart>> part = parseArrayPart(set.field);
    if (!part) return tl::unexpected(part.error());
    const Expected<FieldPlace> place = findFieldOf(*object, *part ? (*part)->field : set.field);
    if (!place) return tl::unexpected(place.error());
    if (*part) return setElements(application, *object, *place, **part, set.values);
    const FindObject find = [&](const std::string& name) -> Expected<ObjectId> {
        const Expected<ObjectInfo> named = application.describe(name);
        if (!named) return tl::unexpected(named.error());
        return named->id;
    };
    const Expected<FieldValue> value = parseValue(find, *place->field, set.values);
    if (!value) return tl::unexpected(value.error());
    ChangeListBuilder edits;
    edits.set(place->object, place->type->type, place->field->id, *value);
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    SceneNames names(application);  // the field may have been the name
    names.learn(std::span(&object->id, 1));
    // What was stopped is not what was asked for.
    return committedAnswer(application, *committed,
                           fmt::format("{} of {} {} {}", set.field, names.node(object->id),
                                       committed->stopped.empty() ? "is" : "was to be", wordOf(*place->field, *value)));
}

Expected<Answer> run(Application& application, const verb::Remove& remove) {
    const Expected<ObjectInfo> node = application.describeNode(remove.node);
    if (!node) return tl::unexpected(node.error());
    const Expected<answer::Committed> committed = application.removeNode(node->id);
    if (!committed) return tl::unexpected(committed.error());
    Answer answer = committedAnswer(application, *committed,
                                    fmt::format("removed {} with {} objects", node->path, committed->removed));
    answer.json["objects"] = committed->removed;
    return answer;
}

Expected<Answer> run(Application& application, const verb::Clone& clone) {
    const Expected<CloneWish> wish = cloneWish(application, clone);
    if (!wish) return tl::unexpected(wish.error());
    const Expected<answer::Committed> committed = application.cloneNode(*wish);
    if (!committed) return tl::unexpected(committed.error());
    const ObjectId copy = committed->ids.empty() ? ObjectId() : committed->ids.front().second;
    SceneNames names(application);
    names.learn(std::span(&copy, 1));
    const std::string path = names.node(copy);
    Answer answer = committedAnswer(
        application, *committed, fmt::format("cloned {} as {}: {} new objects", clone.node, path, committed->created));
    answer.json["node"] = copy.value;
    answer.json["path"] = path;
    answer.json["objects"] = committed->created;
    return answer;
}

/// `what`: as the redo's plan says it, which stands before a redo and behind an undo. Others may have edited meanwhile.
Answer stepAnswer(Application& application, const answer::Committed& committed, std::string_view done,
                  const std::string& what, const std::string& otherwise) {
    Answer answer = committedAnswer(application, committed, what.empty() ? otherwise : fmt::format("{}{}", done, what));
    answer.json["what"] = what;
    return answer;
}

std::string redoOf(Application& application) {
    const Expected<answer::Steps> steps = application.steps();
    return steps ? steps->redo.what : std::string();
}

Expected<Answer> run(Application& application, const verb::Undo&) {
    const Expected<answer::Committed> committed = application.undo();
    if (!committed) return tl::unexpected(committed.error());
    return stepAnswer(application, *committed, "took back: ", redoOf(application), "took back the last change");
}

Expected<Answer> run(Application& application, const verb::Redo&) {
    const std::string what = redoOf(application);
    const Expected<answer::Committed> committed = application.redo();
    if (!committed) return tl::unexpected(committed.error());
    return stepAnswer(application, *committed, "did again: ", what, "did the last change again");
}

Expected<Answer> run(Application& application, const verb::Steps&) {
    const Expected<answer::Steps> steps = application.steps();
    if (!steps) return tl::unexpected(steps.error());
    Answer answer;
    for (const auto& [name, step] : {std::pair("undo", &steps->undo), std::pair("redo", &steps->redo)}) {
        answer.text += fmt::format("{}  {}\n", name, step->what.empty() ? "nothing" : step->what);
        Json objects = Json::array();
        for (const ObjectId id : step->objects) objects.push_back(id.value);
        answer.json[name] = {{"what", step->what}, {"changes", step->changes}, {"objects", std::move(objects)}};
    }
    answer.json["sequence"] = steps->sequence.value;
    return answer;
}

Expected<Answer> run(Application& application, const verb::Drag& drag) {
    const std::size_t each = drag.rays ? 6 : 2;
    using Place = std::array<double, 6>;
    const auto place = [&](std::size_t i) {
        Place numbers{};
        std::copy_n(drag.at.begin() + static_cast<std::ptrdiff_t>(i * each), each, numbers.begin());
        return numbers;
    };
    const auto rayOf = [](const Place& at) { return Ray{Vec3d(at[0], at[1], at[2]), Vec3d(at[3], at[4], at[5])}; };
    const auto aimOf = [](const Place& at) { return Aim{.xPx = at[0], .yPx = at[1], .wand = {}}; };
    Place from = place(0);
    const Expected<answer::Picked> held = drag.rays ? application.grab(rayOf(from)) : application.grab(aimOf(from));
    if (!held) return tl::unexpected(held.error());
    if (!held->hit) return fail(ErrorCode::kNotFound, "no handle of a manipulator is there");
    answer::Committed last;
    for (std::size_t i = 1; i < drag.at.size() / each; ++i) {
        const Place to = place(i);
        for (std::uint32_t step = 1; step <= drag.steps; ++step) {
            Place now = to;
            if (step < drag.steps)
                for (std::size_t k = 0; k < each; ++k) now[k] = from[k] + (to[k] - from[k]) * step / drag.steps;
            Expected<answer::Committed> moved = drag.rays ? application.drag(rayOf(now)) : application.drag(aimOf(now));
            if (!moved) return tl::unexpected(moved.error());
            last = std::move(*moved);
        }
        from = to;
    }
    if (const Expected<void> done = application.release(); !done) return tl::unexpected(done.error());
    SceneNames names(application);
    names.learn(std::span(&held->node, 1));
    Answer answer =
        committedAnswer(application, last, fmt::format("dragged handle {} of {}", held->face, names.node(held->node)));
    answer.json["node"] = held->node.value;
    answer.json["path"] = names.node(held->node);
    answer.json["handle"] = held->face;
    answer.json["point"] = jsonOf(held->point);
    return answer;
}

/// Where a link has led to is nowhere else to be seen.
void tellLink(const std::string& file, Answer& answer) {
    const std::string target = targetOfLink(file);
    if (target.empty()) return;
    answer.text += fmt::format("{}: a link to {}, which was written\n", file, target);
    answer.json["target"] = target;
}

Expected<Answer> saveForOthers(Application& application, const verb::Save& save) {
    const Expected<ExportReport> report = exportScene(save.file, application.scene(), save.leaves);
    if (!report) return tl::unexpected(report.error());
    Answer answer{fmt::format("{}: {} nodes, {} triangles where they stand, {} bytes, change {}\n", save.file,
                              report->nodes, report->triangles, report->bytes, application.sequence().value),
                  {{"file", save.file},
                   {"files", report->files},
                   {"nodes", report->nodes},
                   {"triangles", report->triangles},
                   {"bytes", report->bytes},
                   {"notes", report->notes},
                   {"sequence", application.sequence().value}},
                  {}};
    tellLink(save.file, answer);
    for (std::size_t i = 0; i + 1 < report->files.size(); ++i)
        answer.text += fmt::format("{}: beside it\n", report->files[i]);
    for (const std::string& note : report->notes) answer.text += fmt::format("note: {}\n", note);
    return answer;
}

Expected<Answer> run(Application& application, const verb::Save& save) {
    if (save.foreign) return saveForOthers(application, save);
    const Aspect& scene = application.scene();
    std::string arrays;
    if (const Expected<void> saved = saveScene(save.file, scene, {}, &arrays); !saved)
        return tl::unexpected(saved.error());
    std::error_code unknown;
    const std::uintmax_t bytes = std::filesystem::file_size(save.file, unknown);
    Answer answer{fmt::format("{}: {} objects, {} bytes, change {}\n", save.file, scene.objectCount(), bytes,
                              application.sequence().value),
                  {{"file", save.file},
                   {"objects", scene.objectCount()},
                   {"bytes", bytes},
                   {"sequence", application.sequence().value}},
                  {}};
    tellLink(save.file, answer);
    if (arrays.empty()) return answer;
    const std::uintmax_t besides = std::filesystem::file_size(arrays, unknown);
    answer.text += fmt::format("{}: its arrays, {} bytes; the two belong together\n", arrays, besides);
    answer.json["arrays"] = arrays;
    answer.json["arrays_bytes"] = besides;
    return answer;
}

Expected<Answer> run(Application& application, const verb::Snapshot& snapshot) {
    // A host that has just come, or a frame held by one of them, may leave the tiles of different frames; the next
    // frame puts that right.
    constexpr int kAttempts = 5;
    Expected<Mosaic> mosaic = fail(ErrorCode::kFailed, "no attempt was made");
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const Expected<answer::Images> images = application.images();
        if (!images) return tl::unexpected(images.error());
        mosaic = stitch(application.wall(), *images);
        if (mosaic || mosaic.error().code != ErrorCode::kRefused || images->tiles.empty()) break;
    }
    if (!mosaic) return tl::unexpected(mosaic.error());
    const Picture& picture = mosaic->picture;
    const Expected<void> written = writeFile(snapshot.file, encodePng(picture, mosaic->frame.value));
    if (!written) return tl::unexpected(written.error());
    Answer answer{
        fmt::format("{}: {}x{}, frame {}\n", snapshot.file, picture.widthPx, picture.heightPx, mosaic->frame.value),
        {{"file", snapshot.file},
         {"width", picture.widthPx},
         {"height", picture.heightPx},
         {"frame", mosaic->frame.value},
         {"missing", mosaic->missing}},
        {}};
    if (!mosaic->missing.empty())
        answer.warning = fmt::format("nobody draws {} now: black", fmt::join(mosaic->missing, ", "));
    return answer;
}

/// Whether it is done with a frame.
bool isEdit(const Verb& verb) {
    return std::visit(
        []<typename One>(const One&) {
            return std::is_same_v<One, verb::Load> || std::is_same_v<One, verb::Move> ||
                   std::is_same_v<One, verb::Set> || std::is_same_v<One, verb::Remove> ||
                   std::is_same_v<One, verb::Clone> || std::is_same_v<One, verb::Undo> ||
                   std::is_same_v<One, verb::Redo> || std::is_same_v<One, verb::Play> ||
                   std::is_same_v<One, verb::Drag>;
        },
        verb);
}

/// Empty where frames are made. A wall that waits for hosts makes none before its start deadline is over.
std::string whyNoFrame(Application& application, const std::string& server) {
    const Expected<answer::Status> status = application.status();
    if (!status) return {};
    std::vector<std::string> hosts;
    std::string first;
    for (const answer::HostInfo& host : status->hosts) {
        if (host.state != "absent" && host.state != "joining" && host.state != "syncing") continue;
        if (hosts.empty()) first = host.name;
        hosts.push_back(fmt::format("{}: {}", host.name, host.state));
    }
    if (hosts.empty()) return {};
    if (application.waitForFrame(std::chrono::milliseconds(200))) return {};  // several frames, at any usual rate
    const Expected<ServerMeant> meant = serverMeant(server);
    return withoutControls(fmt::format(
        "no frame is shown yet ({}), edits are made with frames, and the first one waits for hosts, {} s at most. "
        "tessera-client --server {} --host {} starts one",
        fmt::join(hosts, ", "), application.wall().sync.startDeadline.count() / 1000,
        meant ? toString(meant->address) : server, first));
}

/// One verb prints as it goes, one says much in either form.
struct Runner {
    Application& application;
    bool json;
    const Print &print, &warn;

    Expected<Answer> operator()(const verb::Contacts& wanted) const {
        return run(application, wanted, json, print, warn);
    }
    /// carryOut has done these without a server.
    Expected<Answer> operator()(const verb::PlayTracker& played) const { return play(played); }
    Expected<Answer> operator()(const verb::NewWall& wish) const { return makeNewWall(wish, print); }
    Expected<Answer> operator()(const verb::Link&) const { return {}; }
    Expected<Answer> operator()(const verb::Fly&) const { return flyByTerminal(application, print); }
    Expected<Answer> operator()(const verb::Tree& tree) const { return run(application, tree, json); }
    Expected<Answer> operator()(const verb::Find& find) const { return run(application, find, json, print); }
    Expected<Answer> operator()(const verb::Top& top) const { return run(application, top, json); }
    Expected<Answer> operator()(const verb::Watch& watch) const { return run(application, watch, json, print); }
    template <typename Verb>
    Expected<Answer> operator()(const Verb& verb) const {
        return run(application, verb);
    }
};

}  // namespace

Expected<Answer> carryOut(const CommandLine& line, const Print& print, const Print& warn, const Platform& platform) {
    if (const auto* played = std::get_if<verb::PlayTracker>(&line.verb)) return play(*played);
    if (const auto* wish = std::get_if<verb::NewWall>(&line.verb)) return makeNewWall(*wish, print);
    if (const auto* link = std::get_if<verb::Link>(&line.verb)) return linkOf(line, *link);
    Application::Options options;
    options.address = line.server;
    options.tokenFile = line.tokenFile;
    options.keys = line.keys;
    options.name = "tessera-ctl";
    options.timeout = line.timeout;
    // Every other verb costs its answer, however large the scene is.
    const auto* get = std::get_if<verb::Get>(&line.verb);
    options.followScene = std::holds_alternative<verb::Save>(line.verb) || (get != nullptr && asksForBounds(*get));
    if (options.followScene) {
        // Whoever saves a scene, or asks how large it is, wants what it is made of too, however long that takes to
        // come.
        options.wantBlobs = true;
        options.timeout = std::max<std::chrono::milliseconds>(options.timeout, std::chrono::minutes(2));
    }
    // Any object may be a material: the scene is looked at whole, without its arrays.
    options.followScene = options.followScene || std::holds_alternative<verb::Materials>(line.verb);
    Expected<std::unique_ptr<Application>> application = Application::connect(options, platform);
    if (!application) return tl::unexpected(application.error());
    const std::string waiting = isEdit(line.verb) ? whyNoFrame(**application, line.server) : std::string();
    if (!waiting.empty()) warn("tessera-ctl: " + waiting + "\n");
    Expected<Answer> answer = std::visit(Runner{**application, line.json, print, warn}, line.verb);
    if (!answer && answer.error().code == ErrorCode::kNetwork && !waiting.empty())
        return fail(ErrorCode::kNetwork, answer.error().message + "; it stands, and is done with the first frame");
    return answer;
}

namespace {

CtlOutcome outcomeOf(const std::vector<std::string>& words, const Print& print, const Print& warn,
                     const Platform& platform) {
    const auto failed = [](const Error& error) {
        return CtlOutcome{exitCode(error.code), {}, "tessera-ctl: " + error.message + "\n"};
    };
    const auto parsed = parseCommandLine(words);
    if (!parsed) return failed(parsed.error());
    if (const auto* help = std::get_if<HelpText>(&*parsed)) return {0, help->text, {}};
    const auto& line = std::get<CommandLine>(*parsed);
    const Expected<Answer> answer = carryOut(line, print, warn, platform);
    if (!answer) return failed(answer.error());
    CtlOutcome outcome;
    // Names come from files: what is no UTF-8 must not stop the answer. A verb that has printed its entries as they
    // came has none left.
    if (!line.json)
        outcome.out = answer->text;
    else if (!answer->json.is_null())
        outcome.out = answer->json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (!answer->warning.empty()) outcome.err = "tessera-ctl: warning: " + answer->warning + "\n";
    return outcome;
}

}  // namespace

void warnOnStderr(const std::string& lines) {
    std::fwrite(lines.data(), 1, lines.size(), stderr);
}

CtlOutcome runCtl(const std::vector<std::string>& words, const Print& print, const Print& warn,
                  const Platform& platform) {
    CtlOutcome outcome = outcomeOf(
        words, [&](const std::string& lines) { print(withoutControls(lines)); },
        [&](const std::string& lines) { warn(withoutControls(lines)); }, platform);
    outcome.out = withoutControls(std::move(outcome.out));
    outcome.err = withoutControls(std::move(outcome.err));
    return outcome;
}

CtlOutcome runCtl(const std::vector<std::string>& words) {
    std::string printed;
    CtlOutcome outcome = runCtl(words, [&](const std::string& lines) { printed += lines; });
    outcome.out.insert(0, printed);
    return outcome;
}

}  // namespace tessera
