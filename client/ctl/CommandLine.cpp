#include "client/ctl/CommandLine.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <functional>
#include <utility>

#include "client/ctl/Answer.h"
#include "client/ctl/FieldText.h"
#include "client/ctl/MeasureVerbs.h"
#include "client/ctl/NewWall.h"
#include "client/ctl/NumberText.h"
#include "client/ctl/RequestsText.h"
#include "client/ctl/TypesText.h"
#include "client/ctl/VerbFault.h"
#include "client/ctl/VerbWords.h"
#include "client/ctl/WireText.h"
#include "common/base/Version.h"
#include "common/json/ApiJson.h"
#include "common/options/Completion.h"
#include "common/request/Schema.h"
#include "common/wall/Wall.h"

namespace tessera {

namespace {

/// Of a word that may be left out: an empty one is not left out, a variable of a script was empty.
std::string emptyFault(const std::string& text) {
    return text.empty() ? R"(an empty word "" is no value)" : "";
}

/// Loads count from 1: 0 is the scene that the server begins with, which nobody cancels.
std::string loadFault(const std::string& text) {
    const bool isNumber = !text.empty() && text.size() < 19 && text.find_first_not_of("0123456789") == text.npos;
    return isNumber && text.find_first_not_of('0') != text.npos
               ? std::string()
               : fmt::format("'{}' is no load's number, which are whole from 1 on: tessera-ctl loads tells them", text);
}

/// All that is said, and how it travels.
std::string requestsLine() {
    Json json = requestsJson();
    json["wire"] = wireJson();
    return jsonLine(json);
}

Expected<std::variant<CommandLine, HelpText>> typesAnswer(const std::string& type, bool json) {
    if (type.empty()) return HelpText{json ? jsonLine(typesJson()) : typesText()};
    const Expected<std::string> text = json ? typeLine(type) : typeText(type);
    if (!text) return tl::unexpected(text.error());
    return HelpText{*text};
}

}  // namespace

Expected<std::variant<CommandLine, HelpText>> parseCommandLine(const std::vector<std::string>& words) {
    VerbWords in;
    CLI::App app(
        "Talks to a running tessera-server: looks at its scene, changes it,\nmoves the view, fetches the picture.",
        "tessera-ctl");
    app.get_formatter()->column_width(26);
    app.set_version_flag("--version", versionText("tessera-ctl"));
    addCompletion(app);
    app.add_option("--server", in.line.server,
                   "Where the server listens (TESSERA_SERVER, else in\n~/.config/tessera/server, else the one wall of "
                   "this\nmachine)")
        ->type_name("ADDR:PORT");
    app.add_option("--token-file", in.line.tokenFile,
                   "With the server's token (TESSERA_TOKEN, else in\n"
                   "TESSERA_TOKEN_FILE, else of this user's server on\nthis machine)")
        ->type_name("FILE");
    app.add_option("--keys", in.line.keys,
                   "With a person's key (tessera-keys person NAME), or\nthat key's file: for servers of other machines")
        ->type_name("DIR");
    app.add_flag("--json", in.line.json, "Answer in JSON");
    app.add_option("--timeout", in.timeoutSeconds, "Seconds to wait for the server (10)")
        ->type_name("S")
        ->check(CLI::Range(0.01, 86'400.0))
        ->check(numberFault);
    app.require_subcommand(1);
    app.fallthrough();  // the server may be named behind the verb as well

    // A verb is its words, its options, and what these make of it.
    using Make = std::function<Expected<Verb>()>;
    std::vector<std::pair<const CLI::App*, Make>> verbs;
    const auto when = [&](const CLI::App* said, Make make) { verbs.emplace_back(said, std::move(make)); };
    const auto verb = [&](const char* name, const char* help, Make make) {
        when(app.add_subcommand(name, help), std::move(make));
    };

    verb("status", "Frame, hosts, size of the scene", [] { return verb::Status{}; });

    verb("whoami", "As whom the server knows you, and what you may do", [] { return verb::Who{}; });
    verb("people", "Who is connected, in which role", [] { return verb::People{}; });
    CLI::App* link = app.add_subcommand("link", "The link for browsers, to a server of this machine");
    link->add_option("--role", in.role, "viewer, editor or operator (operator)")
        ->type_name("ROLE")
        ->check(CLI::IsMember({"viewer", "editor", "operator"}).description(""));
    when(link, [&] {
        return verb::Link{in.role == "viewer" ? Role::kViewer : in.role == "editor" ? Role::kEditor : Role::kOperator};
    });

    CLI::App* top = app.add_subcommand("top", "Frames, hosts, who is waited for; drawn anew until q");
    top->add_option("--every", in.top.everySeconds, "Seconds from one table to the next (1)")
        ->type_name("S")
        ->check(CLI::Range(0.1, 3600.0))
        ->check(numberFault);
    top->footer(
        "Once, after that time, with --json or where the output is no terminal.\n"
        "SHOWN and HELD count frames since the last table. WAITED FOR looks at the last\n"
        "512 frames: in how many the others waited, how long, what took the host longest.");
    when(top, [&] { return in.top; });
    CLI::App* watch = app.add_subcommand("watch", "What happens: hosts, people, edits, faults");
    watch->add_option("--seconds", in.watch.seconds, "So long (0: until interrupted)")
        ->type_name("S")
        ->check(CLI::Range(0.0, 1e7))
        ->check(numberFault);
    watch->footer(
        "host     what has become of one       frame    one that holds an earlier frame\n"
        "person   who came or went             edit     the newest step, or an undone one\n"
        "journal  whether edits are taken      program  one of a material that is bad\n"
        "detail   what the budget leaves away  link     that to the server\n"
        "Edits are looked for once a second: of several the last is told.");
    when(watch, [&] { return in.watch; });
    CLI::App* trace = app.add_subcommand("trace", "Frames of all hosts as a file for ui.perfetto.dev");
    trace->add_option("FILE", in.trace.file, "FILE.json to write")->required();
    trace->add_option("--frames", in.trace.frames, "So many (300)")->type_name("N")->check(CLI::Range(1, 36'000));
    trace->footer(
        "A slice for each frame, from when it was made to when the hosts had shown it, as\n"
        "the server's news of both came here. Below it, for each host: what it showed or\n"
        "held, its state, how long the others wait for it. What a host does within a\n"
        "frame is not told.");
    when(trace, [&] {
        in.trace.patience = in.line.timeout;
        return in.trace;
    });

    CLI::App* tree = app.add_subcommand("tree", "The nodes of the scene");
    tree->add_option("NODE", in.tree.node, "From here down (/)");
    tree->add_option("--depth", in.tree.depth, "Levels below NODE (all)")->type_name("N")->check(CLI::Range(0, 1'000));
    when(tree, [&] { return in.tree; });

    CLI::App* load = app.add_subcommand("load", "The server imports a file");
    load->add_option("FILE", in.load.file,
                     "asset://NAME, or a file of the server's machine that\nits --allow lets it read")
        ->required();
    load->add_option("--under", in.load.under, "Below this node (/)")->type_name("NODE");
    load->add_flag("--reload", in.load.reload,
                   "One that is in the scene is taken in again in its\nplace: what has changed in the file, without "
                   "what\npeople have changed since; no step of undo");
    const CLI::Option* loadAt =
        load->add_option("--at", in.loadAt,
                         "Where the file's origin comes, in that node's units;\nwith --fit the middle of its underside")
            ->type_name("X Y Z")
            ->expected(3)
            ->check(numberFault);
    const CLI::Option* loadScale =
        load->add_option("--scale", in.loadScale, "So many times its own size")->type_name("S")->check(numberFault);
    const CLI::Option* loadFit =
        load->add_option("--fit", in.loadFit,
                         "So long becomes its longest side, as it stands\nbefore anything plays, in those units")
            ->type_name("METRES")
            ->check(numberFault);
    load->add_option(
            "--up", in.loadUp,
            "Which of its axes is up (as it says; else +Z of\n.stl, .off and flat clouds of points, +Y of others)")
        ->type_name("y|z")
        ->check(CLI::IsMember({"y", "z"}).description(""));
    const CLI::Option* loadRadius =
        load->add_option("--point-radius", in.loadRadius, "Of all its points, in the file's own units")
            ->type_name("R")
            ->check(numberFault);
    load->add_option("--variant", in.load.placing.variants,
                     "Of USD: prim P shows variant N of its set S, as\n/Chair:color=red; may be repeated")
        ->type_name("P:S=N")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    when(load, [&]() -> Expected<Verb> {
        // The server may need some minutes of a busy machine for a large file.
        in.load.patience = std::max<std::chrono::milliseconds>(in.line.timeout, std::chrono::minutes(10));
        Placing& placing = in.load.placing;
        if (*loadAt) placing.at = vector3(in.loadAt);
        if (*loadScale) placing.scale = in.loadScale;
        if (*loadFit) placing.fit = in.loadFit;
        if (*loadRadius) placing.pointRadius = in.loadRadius;
        if (!in.loadUp.empty()) placing.up = in.loadUp == "z" ? UpAxis::kZ : UpAxis::kY;
        if (const Expected<void> sound = checkPlacing(placing); !sound)
            return fail(ErrorCode::kUsage, "load: " + sound.error().message);
        return in.load;
    });

    verb("loads", "Files on their way: how far each is, and whose", [] { return verb::Loads{}; });
    CLI::App* cancel = app.add_subcommand("cancel", "Ends the load of a file that does not appear yet");
    cancel->add_option("N", in.cancel.load, "Its number among the loads (the only one)")->check(loadFault);
    when(cancel, [&] { return in.cancel; });

    CLI::App* move = app.add_subcommand("move", "Moves a node: its Transform, or the nearest above it");
    move->add_option("NODE", in.moveNode, "/path/of/names or #id")->required();
    move->add_option("PLACE", in.moveBy, "X Y Z in its parent's coordinates")
        ->type_name("X Y Z")
        ->expected(0, 3)
        ->check(numberFault);
    move->add_flag("--by", in.by, "From where it is, not from the origin");
    move->add_option("--rotate", in.moveRotate, "About x, y or z")->type_name("AXIS DEG")->expected(2);
    move->add_option("--quaternion", in.moveQuaternion, "Rotation")
        ->type_name("W X Y Z")
        ->expected(4)
        ->check(numberFault);
    move->add_option("--scale", in.moveScale, "In all directions")->type_name("S")->check(numberFault);
    when(move, [&] { return moveVerb(in); });

    CLI::App* set = app.add_subcommand("set", "Sets a field of a node or of its core");
    set->footer(
        "tessera-ctl types lists all fields, their units, bounds and words.\n"
        "An array of numbers is set whole, as long as it shall be: clipPlanes 1 0 0 .5\n"
        "is one plane, 8 numbers are two, none is empty. FIELD@N sets elements that it\n"
        "has, from N on.");
    set->add_option("NODE", in.set.node, "/path/of/names, or #id of any object")->required();
    set->add_option("FIELD", in.set.field,
                    "e.g. translation, choice, intensity;\npoints@17: elements of an array, from 17 on")
        ->required();
    set->add_option("VALUE", in.set.values, "Numbers, a text, a node or none")->required();
    when(set, [&] { return in.set; });

    CLI::App* get = app.add_subcommand("get", "The fields of an object, and of a node's core");
    get->add_option("NODE", in.get.node, "/path/of/names, or #id of any object")->required();
    get->add_option(
        "FIELD", in.get.field,
        "One of them alone, e.g. problem; bounds: the box\nin the world around all that is drawn there and\nbelow");
    when(get, [&] { return in.get; });

    CLI::App* remove = app.add_subcommand("remove", "Removes a node and all below it");
    remove->add_option("NODE", in.remove.node, "/path/of/names or #id")->required();
    when(remove, [&] { return in.remove; });

    CLI::App* clone = app.add_subcommand("clone", "A node and all below it once more, beside it");
    clone->add_option("NODE", in.clone.node, "/path/of/names or #id")->required();
    clone->add_option("--under", in.clone.under, "Below this node instead")->type_name("NODE");
    clone->add_option("--name", in.clone.name, "Of the copy (the original's and a number)")->type_name("NAME");
    clone->add_flag("--deep", in.clone.deep, "Cores, materials, images too: else it shares them");
    clone
        ->add_option("--share", in.clone.share,
                     "With --deep: but for this type of core, material,\nimage …, or this node's core, or #id")
        ->type_name("TYPE|NODE");
    when(clone, [&]() -> Expected<Verb> {
        if (!in.clone.deep && !in.clone.share.empty())
            return fail(ErrorCode::kUsage, "clone: --share needs --deep: without it all cores are shared");
        return in.clone;
    });

    CLI::App* find = app.add_subcommand("find", "The nodes that an expression names");
    find->footer(
        "wheel*  /hall/**/wheel?  //*[Geometry][visible]  /hall/crane/*[hidden]\n"
        "* stands for any characters of a name, ? for one, ** for any number of levels.");
    find->add_option("EXPRESSION", in.find.expression,
                     "A path with * ? ** //, and conditions in brackets:\na type of core, visible, hidden")
        ->required();
    find->add_option("--under", in.find.under, "The expression's / (the root)")->type_name("NODE");
    find->add_option("--type", in.find.type, "Only nodes with such a core")->type_name("TYPE");
    find->add_option("--page-size", in.find.pageSize, "Nodes in one answer of the server, 1 to 512 (256)")
        ->type_name("N")
        ->check(CLI::Range(1, 512));
    find->add_option("--limit", in.find.limit, "Nodes at most (all)")
        ->type_name("N")
        ->check(CLI::Range(0, 100'000'000));
    when(find, [&] { return in.find; });

    CLI::App* types = app.add_subcommand("types", "All types and fields; needs no server");
    types->add_option("TYPE", in.type, "This one alone, with a sentence for each field");
    types->add_flag("--json", in.line.json, "Answer in JSON");  // here too, as with the programs that need no server

    CLI::App* requests = app.add_subcommand("requests", "All that an application may ask; needs no server");
    requests->add_flag("--json", in.line.json, "All of it as data: fields, units, bounds, roles");
    requests->add_flag("--proto", in.asSchema, "The protobuf schema of what goes over the wire");

    verb("undo", "Takes back the last change", [] { return verb::Undo{}; });
    verb("redo", "Does again what was taken back last", [] { return verb::Redo{}; });
    verb("steps", "What undo and redo would do now", [] { return verb::Steps{}; });

    verb("materials", "What they look like, and who uses them", [] { return verb::Materials{}; });

    CLI::App* view = app.add_subcommand("view", "Where the wall and heads are, or moves them");
    view->add_option("--position", in.position, "Of the wall's origin, world units")
        ->type_name("X Y Z")
        ->expected(3)
        ->check(numberFault);
    view->add_option("--look-at", in.lookAt, "Turns the wall from --position to here")
        ->type_name("X Y Z")
        ->expected(3)
        ->check(numberFault);
    view->add_option("--orientation", in.orientation, "Of the wall")
        ->type_name("W X Y Z")
        ->expected(4)
        ->check(numberFault);
    const CLI::Option* scale =
        view->add_option("--scale", in.scale, "World units per metre")->type_name("S")->check(numberFault);
    view->add_option("--head", in.head, "A user's head, metres")->type_name("USER X Y Z")->expected(4);
    view->add_flag("--by", in.viewBy,
                   "--position, --orientation, --scale from where it is:\nso far along the world's axes, turned, "
                   "scaled by so\nmuch; worked out here, from where it stands now");
    view->add_flag("--reset", in.reset, "Back to the scene's camera first");
    when(view, [&] { return viewVerb(in, scale->count() > 0); });

    verb("fly", "This terminal's keys fly the wall; ? lists them", [] { return verb::Fly{}; });

    CLI::App* navigate = app.add_subcommand("navigate", "As a person at a window would: a mode, or a place");
    navigate->add_option("WHAT", in.navigateWhat, "fly, orbit or walk; home; fit [NODE]; bookmark N")->required();
    navigate->add_option("WHERE", in.navigateWhere,
                         "Of fit a node (the whole scene), as it stands now;\nof bookmark 1 to 9");
    when(navigate, [&] { return navigateVerb(in); });

    CLI::App* bookmark = app.add_subcommand(
        "bookmark", "Goes to a place that was kept, else to the scene's\ncamera N; or keeps this one");
    bookmark->add_option("N", in.bookmark, "1 to 9")->required()->check(CLI::Range(1, 9));
    bookmark->add_flag("--keep", in.keep, "Where the wall stands now");
    when(bookmark, [&] { return verb::Navigate{bookmarkWish(in.bookmark, in.keep), {}}; });

    CLI::App* pick = app.add_subcommand("pick", "What is under a pixel of the picture");
    const CLI::Option* pickX = pick->add_option("X", in.pick.xPx, "From the left");
    const CLI::Option* pickY = pick->add_option("Y", in.pick.yPx, "From the top");
    pick->add_option("--wand", in.pick.wand, "What this wand points at instead")->type_name("NAME");
    when(pick, [&]() -> Expected<Verb> {
        const auto numbers = pickX->count() + pickY->count();
        if (in.pick.wand.empty() ? numbers != 2 : numbers != 0)
            return fail(ErrorCode::kUsage, "pick: say X and Y, or --wand NAME");
        return in.pick;
    });

    CLI::App* measure = app.add_subcommand("measure", "How far it is from a place to a place, or to a node");
    measure->add_option("FROM", in.measureFrom, "X,Y,Z in the world; or a node: its nearest surface")->required();
    measure->add_option("TO", in.measureTo, "The same; one of the two is a place")->required();
    when(measure, [&]() -> Expected<Verb> {
        Expected<verb::Measure> wanted = measureVerb(in.measureFrom, in.measureTo);
        if (!wanted) return tl::unexpected(wanted.error());
        return *wanted;
    });

    CLI::App* drag = app.add_subcommand("drag", "Takes hold of a manipulator's handle, and leads it");
    drag->add_option("PLACES", in.drag.at, "Pixels X Y: of the handle, and where to")->required()->check(numberFault);
    drag->add_flag("--rays", in.drag.rays, "Places are rays: origin, direction (X Y Z each)");
    drag->add_option("--steps", in.drag.steps, "Edits from one place to the next")->check(CLI::Range(1, 1000));
    when(drag, [&]() -> Expected<Verb> {
        const std::size_t each = in.drag.rays ? 6 : 2;
        if (in.drag.at.size() % each != 0 || in.drag.at.size() < 2 * each)
            return fail(ErrorCode::kUsage, fmt::format("drag: say two places or more, of {} numbers each", each));
        return in.drag;
    });

    verb("animations", "What plays, or could; its time and length in s", [] { return verb::Animations{}; });
    const auto ofAnimation = [&](const char* word, const char* what) {
        CLI::App* one = app.add_subcommand(word, what);
        one->add_option("NODE", in.take.node, "An animation's; tessera-ctl animations lists them")->required();
        return one;
    };
    const CLI::App* playOne = ofAnimation("play", "An animation goes on from where it is");
    const CLI::App* pauseOne = ofAnimation("pause", "An animation stands");
    CLI::App* seek = ofAnimation("seek", "An animation shows another time");
    seek->add_option("SECONDS", in.seconds, "From its beginning; beyond an end it stays there, or\ngoes round")
        ->required()
        ->check(numberFault);
    CLI::App* speedOf = ofAnimation("speed", "How fast an animation plays");
    speedOf->add_option("FACTOR", in.speed, "1: as made; below 0: backwards")->required()->check(numberFault);
    when(playOne, [&] { return verb::Play{.node = in.take.node, .playing = true, .time = {}, .speed = {}}; });
    when(pauseOne, [&] { return verb::Play{.node = in.take.node, .playing = false, .time = {}, .speed = {}}; });
    when(seek, [&] { return verb::Play{.node = in.take.node, .playing = {}, .time = in.seconds, .speed = {}}; });
    when(speedOf, [&] { return verb::Play{.node = in.take.node, .playing = {}, .time = {}, .speed = in.speed}; });

    verb("inlines", "Files that nodes hold: which load, which failed", [] { return verb::Inlines{}; });

    CLI::App* files = app.add_subcommand("files", "What lies in the server's folders that load reads");
    files->add_option("FOLDER", in.files.folder, "One of them, or below one; without it they are listed");
    when(files, [&] { return in.files; });

    verb("trackers", "What the wall's trackers say, and how well", [] { return verb::Trackers{}; });

    CLI::App* play = app.add_subcommand("play-tracker", "Sends poses as a tracker would; needs no server");
    play->add_option("TO", in.play.to, "HOST:PORT, where a wall's tracker listens")->required();
    play->add_option("FILE", in.play.file, "Lines of TIME X Y Z [QW QX QY QZ], metres (a circle)");
    play->add_option("--protocol", in.playProtocol, "dtrack or osc (dtrack)")->check(CLI::IsMember({"dtrack", "osc"}));
    play->add_option("--sensor", in.play.sensor, "The body's number (0)")->type_name("N")->check(CLI::Range(0, 65535));
    play->add_flag("--flystick", in.play.flystick, "A flystick instead of a body; DTrack");
    play->add_option("--buttons", in.play.buttons, "Pressed, 1 + 2 + 4 …; with --flystick")
        ->type_name("BITS")
        ->check(CLI::Range(0, 255));
    play->add_option("--rate", in.play.rateHz, "Poses a second (60)")
        ->type_name("HZ")
        ->check(CLI::Range(0.1, 1000.0))
        ->check(numberFault);
    play->add_option("--seconds", in.play.seconds, "So long (10); 0: until interrupted")
        ->type_name("S")
        ->check(CLI::Range(0.0, 1e6))
        ->check(numberFault);
    when(play, [&]() -> Expected<Verb> {
        in.play.osc = in.playProtocol == "osc";
        if (in.play.osc && in.play.flystick)
            return fail(ErrorCode::kUsage, "play-tracker: --flystick is DTrack's; OSC has bodies here");
        return in.play;
    });

    when(addNewWall(app, in.newWall), [&] { return in.newWall; });

    CLI::App* contacts = app.add_subcommand("contacts", "What touches now");
    contacts->add_flag("--events", in.contacts.events, "Who began, goes on or ceased to touch");
    contacts->add_flag("--distances", in.contacts.distances, "Who is how near");
    contacts->add_flag("--follow", in.contacts.follow, "Events of each frame as they come");
    const CLI::Option* frames =
        contacts->add_option("--frames", in.contacts.frames, "With --follow: so many")->type_name("N");
    contacts->add_flag("--stays", in.contacts.stays, "With --follow: what goes on touching too");
    contacts->add_option("--limit", in.contacts.limit, "Rows at most (all)")->type_name("N");
    contacts->add_option("--interest", in.contacts.interest, "Of this Interest only (all)")->type_name("NODE");
    contacts->add_option("--show", in.show, "Draw points,normals,faces or none")->type_name("WHAT");
    when(contacts, [&] { return contactsVerb(in, frames->count() > 0); });

    verb("questions", "What stopped motions wait for", [] { return verb::Questions{}; });

    CLI::App* respond = app.add_subcommand("answer", "Decides a question");
    respond->add_option("ID", in.respond.question, "The question's number")->required();
    respond->add_option("DECISION", in.decision, "stop, pass or move")->required();
    respond->add_option("PLACE", in.respondTo, "Where to, with move")
        ->type_name("X Y Z")
        ->expected(0, 3)
        ->check(numberFault);
    when(respond, [&] { return respondVerb(in); });

    CLI::App* picture = app.add_subcommand("show", "The scene, or the test picture, on all tiles");
    picture->add_option("WHAT", in.picture, "scene or test-picture")
        ->required()
        ->check(CLI::IsMember({"scene", "test-picture"}).description(""));
    picture->add_flag("--count", in.count, "With test-picture: the number of each frame");
    when(picture, [&] { return showVerb(in); });

    CLI::App* budget = app.add_subcommand("budget", "Milliseconds that a frame may take before detail goes");
    budget->add_option("MS", in.budget, "A number, or off; without it what there is is told")->check(emptyFault);
    when(budget, [&] { return budgetVerb(in); });

    CLI::App* exposure = app.add_subcommand("exposure", "How bright the wall shows its scene");
    exposure
        ->add_option("EV", in.exposure,
                     "Stops; metered: once for all tiles; off; scene: as that\nsays. Without it what there is is told")
        ->check(emptyFault);
    exposure
        ->add_option("--tone-map", in.toneMap,
                     "The curve for what is brighter than white: neutral,\nclamp, "
                     "reinhard, aces or agx")
        ->check(emptyFault)
        ->type_name("NAME");
    when(exposure, [&] { return exposureVerb(in); });

    CLI::App* snapshot = app.add_subcommand("snapshot", "The wall as it is now, as a picture");
    snapshot->add_option("FILE", in.snapshot.file, "FILE.png to write")->required();
    when(snapshot, [&] { return in.snapshot; });

    CLI::App* save = app.add_subcommand("save", "The scene as it is now, as a file of this machine");
    save->add_option("FILE", in.save.file,
                     "FILE.tsc (binary) or FILE.tsct (text) to write, here\nand not at the server; a text's large "
                     "arrays lie\nbeside it in FILE.….arrays: the two belong\ntogether; films, and scenes of Inline "
                     "and\nProxyGroup, stay files of their own. For other\nprograms what is shown, as far as they have "
                     "it:\n" +
                         exportEndings())
        ->required();
    const CLI::Option* under =
        save->add_option("--under", in.save.leaves.under,
                         "For other programs: this node and what is below\nit alone, where it stands")
            ->type_name("NODE");
    save->add_flag("--still", in.save.leaves.still, "For other programs: without animations");
    save->add_option("--tolerance", in.save.leaves.tolerance,
                     "For other programs: how far triangles may be off\nsmooth surfaces and letters")
        ->type_name("METRES")
        ->check(CLI::Validator(CLI::Number).description(""));
    when(save, [&, under]() -> Expected<Verb> {
        if (under->count() > 0 && in.save.leaves.under.empty()) return fail(ErrorCode::kUsage, kNoUnder);
        // Before the scene is fetched, not after it.
        const Expected<bool> foreign = leadsOut(in.save.file, in.save.leaves);
        if (!foreign) return tl::unexpected(foreign.error());
        in.save.foreign = *foreign;
        return in.save;
    });

    try {
        std::vector<std::string> reversed = withVerbFirst(app, withPlainNumbers(words));
        std::ranges::reverse(reversed);  // as CLI11 wants them
        app.parse(std::move(reversed));
    } catch (const CLI::CallForHelp&) {
        const auto chosen = app.get_subcommands();
        return HelpText{chosen.empty() ? app.help() : chosen.front()->help("tessera-ctl --server ADDR:PORT")};
    } catch (const CLI::CallForVersion& asked) {
        return HelpText{std::string(asked.what()) + "\n"};
    } catch (const CLI::ParseError& wrong) {
        const auto chosen = app.get_subcommands();
        if (dynamic_cast<const CLI::RequiredError*>(&wrong) != nullptr && chosen.empty())
            return fail(ErrorCode::kUsage, verbFault(app, words));
        // -inf and -nan were taken for options that nobody knows, and what they stand for was missing.
        std::string what = wrong.what();
        for (const std::string& word : words)
            if (const std::string fault = numberFault(word); word.starts_with('-') && fault.starts_with(word))
                what = fault;
        what += optionMeant(chosen.empty() ? app : *chosen.front(), words);
        return fail(ErrorCode::kUsage, fmt::format("{}; see tessera-ctl {}--help", what,
                                                   chosen.empty() ? "" : chosen.front()->get_name() + " "));
    }

    if (requests->parsed())
        return HelpText{in.asSchema ? applicationSchema() : in.line.json ? requestsLine() : requestsText()};
    if (types->parsed()) return typesAnswer(in.type, in.line.json);
    in.line.timeout = std::chrono::milliseconds(static_cast<std::int64_t>(in.timeoutSeconds * 1000));
    const auto said = std::ranges::find_if(verbs, [](const auto& one) { return one.first->parsed(); });
    TESSERA_CHECK(said != verbs.end(), "a verb is required, and each has said what it makes");
    Expected<Verb> made = said->second();
    if (!made) return tl::unexpected(made.error());
    in.line.verb = std::move(*made);
    return in.line;
}

}  // namespace tessera
