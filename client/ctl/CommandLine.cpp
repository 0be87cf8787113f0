#include "client/ctl/CommandLine.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "client/ctl/Answer.h"
#include "client/ctl/FieldText.h"
#include "client/ctl/MeasureVerbs.h"
#include "client/ctl/NewWall.h"
#include "client/ctl/NumberText.h"
#include "client/ctl/RequestsText.h"
#include "client/ctl/TypesText.h"
#include "client/ctl/VerbFault.h"
#include "client/ctl/WireText.h"
#include "common/base/Version.h"
#include "common/json/ApiJson.h"
#include "common/options/Completion.h"
#include "common/request/Schema.h"
#include "common/scenefile/SceneFile.h"
#include "common/wall/Wall.h"

namespace tessera {

namespace {

/// All that is said, and how it travels.
std::string requestsLine() {
    Json json = requestsJson();
    json["wire"] = wireJson();
    return jsonLine(json);
}

/// What CLI11 fills in; the values of all verbs side by side.
struct Words {
    CommandLine line;
    double timeoutSeconds = 10;
    std::string role;
    bool asSchema = false;
    verb::Tree tree;
    verb::Load load;
    std::vector<double> loadAt;
    double loadScale = 0, loadFit = 0, loadRadius = 0;
    std::string loadUp;
    verb::Set set;
    verb::Get get;
    verb::Remove remove;
    verb::Clone clone;
    verb::Find find;
    verb::Pick pick;
    verb::Drag drag;
    verb::Snapshot snapshot;
    verb::Save save;
    verb::Files files;
    std::string moveNode;
    std::vector<double> moveBy, moveQuaternion;
    bool by = false;
    std::vector<std::string> moveRotate;
    std::optional<double> moveScale;
    std::vector<double> position, lookAt, orientation;
    double scale = 1;
    std::vector<std::string> head;
    bool reset = false;
    std::string measureFrom, measureTo;
    std::string navigateWhat, navigateWhere;
    std::uint32_t bookmark = 0;
    bool keep = false;
    verb::Contacts contacts;
    std::string show, picture, budget;
    bool count = false;
    verb::Respond respond;
    std::string decision;
    std::vector<double> respondTo;
    verb::PlayTracker play;
    verb::NewWall newWall;
    verb::Play take;
    double seconds = 0, speed = 1;
    std::string playProtocol = "dtrack";
};

Vec3d vector3(const std::vector<double>& v) {
    return {v[0], v[1], v[2]};
}

Expected<Quatd> quaternion(const std::vector<double>& wxyz, std::string_view option) {
    const Quatd q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if (!tellsRotation(q.squaredNorm()))
        return fail(ErrorCode::kUsage, fmt::format("{}: its length is 0, or nearly, or beyond what numbers can hold", option));
    return q.normalized();
}

Expected<Quatd> axisRotation(const std::vector<std::string>& words) {
    Vec3d axis = Vec3d::Zero();
    if (words[0] == "x") axis = Vec3d::UnitX();
    if (words[0] == "y") axis = Vec3d::UnitY();
    if (words[0] == "z") axis = Vec3d::UnitZ();
    if (axis.isZero())
        return fail(ErrorCode::kUsage, fmt::format("--rotate: \"{}\" is no axis; write x, y or z", words[0]));
    const Expected<double> degrees = finiteNumber(words[1], "--rotate");
    if (!degrees) return tl::unexpected(degrees.error());
    return Quatd(Eigen::AngleAxisd(*degrees * std::numbers::pi / 180.0, axis));
}

Expected<Verb> moveVerb(const Words& words) {
    NodeMove move;
    move.relative = words.by;
    if (!words.moveBy.empty()) {
        if (words.moveBy.size() != 3) return fail(ErrorCode::kUsage, "move: a place has three numbers, X Y Z");
        move.translation = vector3(words.moveBy);
    }
    if (!words.moveRotate.empty() && !words.moveQuaternion.empty())
        return fail(ErrorCode::kUsage, "move: --rotate and --quaternion say the same thing; give one");
    if (!words.moveRotate.empty() || !words.moveQuaternion.empty()) {
        const Expected<Quatd> rotation = words.moveQuaternion.empty()
                                             ? axisRotation(words.moveRotate)
                                             : quaternion(words.moveQuaternion, "--quaternion");
        if (!rotation) return tl::unexpected(rotation.error());
        move.rotation = *rotation;
    }
    if (words.moveScale) move.scale = Vec3d::Constant(*words.moveScale);
    if (!move.translation && !move.rotation && !move.scale)
        return fail(ErrorCode::kUsage, "move: say where to: X Y Z, --rotate, --quaternion or --scale");
    return verb::Move{words.moveNode, move};
}

Expected<Verb> viewVerb(const Words& words, bool scaleGiven) {
    ViewWish view;
    view.reset = words.reset;
    if (!words.position.empty()) view.position = vector3(words.position);
    if (!words.orientation.empty() && !words.lookAt.empty())
        return fail(ErrorCode::kUsage, "view: --look-at and --orientation say the same thing; give one");
    if (!words.orientation.empty()) {
        const Expected<Quatd> q = quaternion(words.orientation, "--orientation");
        if (!q) return tl::unexpected(q.error());
        view.orientation = *q;
    }
    if (!words.lookAt.empty()) {
        if (!view.position) return fail(ErrorCode::kUsage, "view: --look-at needs --position too");
        const Expected<Quatd> q = lookAlong(vector3(words.lookAt) - *view.position);
        if (!q) return tl::unexpected(q.error());
        view.orientation = *q;
    }
    if (scaleGiven) {
        if (!(words.scale > 0)) return fail(ErrorCode::kUsage, "view: --scale must be above zero");
        view.worldUnitsPerMetre = words.scale;
    }
    if (!words.head.empty()) {
        view.user = words.head[0];
        Vec3d head;
        for (int i = 0; i < 3; ++i) {
            const Expected<double> value = finiteNumber(words.head[static_cast<std::size_t>(i) + 1], "--head");
            if (!value) return tl::unexpected(value.error());
            head[i] = *value;
        }
        view.head = head;
    }
    if (!view.position && !view.orientation && !view.worldUnitsPerMetre && !view.head && !view.reset)
        return fail(ErrorCode::kUsage, "view: say what to change; see tessera-ctl view --help");
    return verb::View{view};
}

NavigationWish bookmarkWish(std::uint32_t number, bool keep) {
    using Deed = NavigationWish::Deed;
    return {.deed = keep ? Deed::kKeepBookmark : Deed::kGoToBookmark, .bookmark = number};
}

Expected<Verb> navigateVerb(const Words& words) {
    using Deed = NavigationWish::Deed;
    const auto refuse = [](std::string why) { return fail(ErrorCode::kUsage, "navigate: " + why); };
    const std::string& what = words.navigateWhat;
    const std::string& where = words.navigateWhere;
    if (what == "fit") return verb::Navigate{{.deed = Deed::kFit}, where};
    if (what == "bookmark") {
        std::uint32_t number = 0;
        const auto [end, error] = std::from_chars(where.data(), where.data() + where.size(), number);
        if (error != std::errc() || end != where.data() + where.size() || number < 1 || number > kBookmarks)
            return refuse(fmt::format("\"{}\" is no bookmark; 1 to {} are", where, kBookmarks));
        return verb::Navigate{bookmarkWish(number, false), {}};
    }
    if (!where.empty()) return refuse(fmt::format("{} takes nothing more", what));
    if (what == "home") return verb::Navigate{{.deed = Deed::kHome}, {}};
    if (const std::optional<NavigationMode> mode = parseNavigationMode(what)) return verb::Navigate{{.mode = mode}, {}};
    return refuse(fmt::format("\"{}\" is nothing that can be asked for; write fly, orbit, walk, home, fit or bookmark", what));
}

Expected<Verb> contactsVerb(const Words& words, bool framesGiven) {
    verb::Contacts contacts = words.contacts;
    const auto refuse = [](std::string why) { return fail(ErrorCode::kUsage, "contacts: " + why); };
    if (contacts.limit < -1) return refuse("--limit cannot be below zero");
    if (framesGiven && contacts.frames <= 0) return refuse("--frames must be above zero");
    if (!contacts.follow && (framesGiven || contacts.stays)) return refuse("--frames and --stays need --follow");
    if (words.show.empty()) return contacts;
    if (contacts.events || contacts.distances || contacts.follow || contacts.limit >= 0)
        return refuse("--show draws; ask for lists without it");
    contacts.show = numberOfWord(showField(), words.show);
    if (!contacts.show)
        return refuse(fmt::format("--show takes points, normals, faces with commas between them, or none, not \"{}\"",
                                  words.show));
    return contacts;
}

Expected<Verb> showVerb(const Words& words) {
    if (words.picture != "scene") return verb::Show{words.count ? Showing::kCountedTestPicture : Showing::kTestPicture};
    if (words.count) return fail(ErrorCode::kUsage, "show: --count is for the test picture");
    return verb::Show{};
}

Expected<Verb> budgetVerb(const Words& words) {
    if (words.budget.empty()) return verb::Budget{};
    if (words.budget == "off") return verb::Budget{0.0};
    double number = 0;
    const auto [end, error] = std::from_chars(words.budget.data(), words.budget.data() + words.budget.size(), number);
    if (error != std::errc() || end != words.budget.data() + words.budget.size() || !isBudget(number))
        return fail(ErrorCode::kUsage, fmt::format("budget: \"{}\" is none; write off, or 0.1 to 60000 milliseconds", words.budget));
    return verb::Budget{number};
}

Expected<Verb> respondVerb(const Words& words) {
    using Decision = QuestionReply::Decision;
    verb::Respond respond = words.respond;
    if (words.decision == "pass")
        respond.decision = Decision::kPass;
    else if (words.decision == "move")
        respond.decision = Decision::kMove;
    else if (words.decision != "stop")
        return fail(ErrorCode::kUsage,
                    fmt::format("answer: \"{}\" is no decision; write stop, pass or move", words.decision));
    const bool moves = respond.decision == Decision::kMove;
    if (words.respondTo.size() != (moves ? 3 : 0))
        return fail(ErrorCode::kUsage, moves ? std::string("answer: move needs a place, X Y Z")
                                             : fmt::format("answer: {} takes no numbers", words.decision));
    if (moves) respond.place = vector3(words.respondTo);
    return respond;
}

}  // namespace

Expected<Quatd> lookAlong(const Vec3d& direction) {
    if (!(direction.norm() > 0)) return fail(ErrorCode::kUsage, "view: --look-at and --position are the same point");
    const Vec3d back = -direction.normalized();
    Vec3d right = Vec3d::UnitY().cross(back);
    // Straight up or down, every right is as good: keep +X.
    if (right.norm() < 1e-9) right = Vec3d::UnitX();
    right.normalize();
    Mat3d axes;
    axes.col(0) = right;
    axes.col(1) = back.cross(right);
    axes.col(2) = back;
    return Quatd(axes);
}

Expected<std::variant<CommandLine, HelpText>> parseCommandLine(const std::vector<std::string>& words) {
    Words in;
    CLI::App app(
        "Talks to a running tessera-server: looks at its scene, changes it,\nmoves the view, fetches the picture.",
        "tessera-ctl");
    app.get_formatter()->column_width(26);
    app.set_version_flag("--version", versionText("tessera-ctl"));
    addCompletion(app);
    app.add_option("--server", in.line.server,
                   "Where the server listens (TESSERA_SERVER, else the\none wall of this machine)")
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

    const CLI::App* status = app.add_subcommand("status", "Frame, hosts, size of the scene");

    const CLI::App* whoAmI = app.add_subcommand("whoami", "As whom the server knows you, and what you may do");
    const CLI::App* people = app.add_subcommand("people", "Who is connected, in which role");
    CLI::App* link = app.add_subcommand("link", "The link for browsers, to a server of this machine");
    link->add_option("--role", in.role, "viewer, editor or operator (operator)")
        ->type_name("ROLE")
        ->check(CLI::IsMember({"viewer", "editor", "operator"}).description(""));

    CLI::App* tree = app.add_subcommand("tree", "The nodes of the scene");
    tree->add_option("NODE", in.tree.node, "From here down (/)");
    tree->add_option("--depth", in.tree.depth, "Levels below NODE (all)")->type_name("N")->check(CLI::Range(0, 1'000));

    CLI::App* load = app.add_subcommand("load", "The server imports a file");
    load->add_option("FILE", in.load.file, "asset://NAME, or a file of the server's machine that\nits --allow lets it read")->required();
    load->add_option("--under", in.load.under, "Below this node (/)")->type_name("NODE");
    load->add_flag("--reload", in.load.reload, "One that is in the scene is taken in again in its\nplace: what has changed in the file, without what\npeople have changed since; no step of undo");
    const CLI::Option* loadAt = load->add_option("--at", in.loadAt, "Where the file's origin comes, in that node's units;\nwith --fit the middle of its underside")
                                    ->type_name("X Y Z")->expected(3)->check(numberFault);
    const CLI::Option* loadScale = load->add_option("--scale", in.loadScale, "So many times its own size")->type_name("S")->check(numberFault);
    const CLI::Option* loadFit = load->add_option("--fit", in.loadFit, "So long becomes its longest side, as it stands\nbefore anything plays, in those units")
                                     ->type_name("METRES")->check(numberFault);
    load->add_option("--up", in.loadUp, "Which of its axes is up (as it says; else +Z of\n.stl, .off and flat clouds of points, +Y of others)")
        ->type_name("y|z")->check(CLI::IsMember({"y", "z"}).description(""));
    const CLI::Option* loadRadius = load->add_option("--point-radius", in.loadRadius, "Of all its points, in the file's own units")
                                        ->type_name("R")->check(numberFault);

    CLI::App* move = app.add_subcommand("move", "Moves a node: its Transform, or the nearest above it");
    move->add_option("NODE", in.moveNode, "/path/of/names or #id")->required();
    move->add_option("PLACE", in.moveBy, "X Y Z in its parent's coordinates")->type_name("X Y Z")->expected(0, 3)->check(numberFault);
    move->add_flag("--by", in.by, "From where it is, not from the origin");
    move->add_option("--rotate", in.moveRotate, "About x, y or z")->type_name("AXIS DEG")->expected(2);
    move->add_option("--quaternion", in.moveQuaternion, "Rotation")->type_name("W X Y Z")->expected(4)->check(numberFault);
    move->add_option("--scale", in.moveScale, "In all directions")->type_name("S")->check(numberFault);

    CLI::App* set = app.add_subcommand("set", "Sets a field of a node or of its core");
    set->footer("tessera-ctl types lists all fields, their units, bounds and words.\n"
                "An array of numbers is set whole, as long as it shall be: clipPlanes 1 0 0 .5\n"
                "is one plane, 8 numbers are two, none is empty. FIELD@N sets elements that it\n"
                "has, from N on.");
    set->add_option("NODE", in.set.node, "/path/of/names, or #id of any object")->required();
    set->add_option("FIELD", in.set.field, "e.g. translation, choice, intensity;\npoints@17: elements of an array, from 17 on")->required();
    set->add_option("VALUE", in.set.values, "Numbers, a text, a node or none")->required();

    CLI::App* get = app.add_subcommand("get", "The fields of an object, and of a node's core");
    get->add_option("NODE", in.get.node, "/path/of/names, or #id of any object")->required();
    get->add_option(
        "FIELD", in.get.field,
        "One of them alone, e.g. problem; bounds: the box\nin the world around all that is drawn there and\nbelow");

    CLI::App* remove = app.add_subcommand("remove", "Removes a node and all below it");
    remove->add_option("NODE", in.remove.node, "/path/of/names or #id")->required();

    CLI::App* clone = app.add_subcommand("clone", "A node and all below it once more, beside it");
    clone->add_option("NODE", in.clone.node, "/path/of/names or #id")->required();
    clone->add_option("--under", in.clone.under, "Below this node instead")->type_name("NODE");
    clone->add_option("--name", in.clone.name, "Of the copy (as the original's)")->type_name("NAME");
    clone->add_flag("--deep", in.clone.deep, "Cores, materials, images too: else it shares them");
    clone->add_option("--share", in.clone.share, "With --deep: but for this type of core, material,\nimage …, or this node's core, or #id")
        ->type_name("TYPE|NODE");

    CLI::App* find = app.add_subcommand("find", "The nodes that an expression names");
    find->footer("wheel*  /hall/**/wheel?  //*[Geometry][visible]  /hall/crane/*[hidden]\n"
                 "* stands for any characters of a name, ? for one, ** for any number of levels.");
    find->add_option("EXPRESSION", in.find.expression, "A path with * ? ** //, and conditions in brackets:\na type of core, visible, hidden")->required();
    find->add_option("--under", in.find.under, "The expression's / (the root)")->type_name("NODE");
    find->add_option("--type", in.find.type, "Only nodes with such a core")->type_name("TYPE");
    find->add_option("--page-size", in.find.pageSize, "Nodes in one answer of the server, 1 to 512 (256)")->type_name("N")->check(CLI::Range(1, 512));
    find->add_option("--limit", in.find.limit, "Nodes at most (all)")->type_name("N")->check(CLI::Range(0, 100'000'000));

    CLI::App* types = app.add_subcommand("types", "All types and fields; needs no server");
    types->add_flag("--json", in.line.json, "Answer in JSON");  // here too, as with the programs that need no server

    CLI::App* requests = app.add_subcommand("requests", "All that an application may ask; needs no server");
    requests->add_flag("--json", in.line.json, "All of it as data: fields, units, bounds, roles");
    requests->add_flag("--proto", in.asSchema, "The protobuf schema of what goes over the wire");

    const CLI::App* undo = app.add_subcommand("undo", "Takes back the last change");
    const CLI::App* redo = app.add_subcommand("redo", "Does again what was taken back last");
    const CLI::App* steps = app.add_subcommand("steps", "What undo and redo would do now");

    CLI::App* view = app.add_subcommand("view", "Moves the wall through the world, or a head before it");
    view->add_option("--position", in.position, "Of the wall's origin, world units")->type_name("X Y Z")->expected(3)->check(numberFault);
    view->add_option("--look-at", in.lookAt, "Turns the wall from --position to here")->type_name("X Y Z")->expected(3)->check(numberFault);
    view->add_option("--orientation", in.orientation, "Of the wall")->type_name("W X Y Z")->expected(4)->check(numberFault);
    const CLI::Option* scale = view->add_option("--scale", in.scale, "World units per metre")->type_name("S")->check(numberFault);
    view->add_option("--head", in.head, "A user's head, metres")->type_name("USER X Y Z")->expected(4);
    view->add_flag("--reset", in.reset, "Back to the scene's camera first");

    const CLI::App* fly = app.add_subcommand("fly", "This terminal's keys fly the wall; ? lists them");

    CLI::App* navigate = app.add_subcommand("navigate", "As a person at a window would: a mode, or a place");
    navigate->add_option("WHAT", in.navigateWhat, "fly, orbit or walk; home; fit [NODE]; bookmark N")->required();
    navigate->add_option("WHERE", in.navigateWhere, "Of fit a node (the whole scene), as it stands now;\nof bookmark 1 to 9");

    CLI::App* bookmark = app.add_subcommand("bookmark", "Goes to a place that was kept, or keeps this one");
    bookmark->add_option("N", in.bookmark, "1 to 9")->required()->check(CLI::Range(1, 9));
    bookmark->add_flag("--keep", in.keep, "Where the wall stands now");

    CLI::App* pick = app.add_subcommand("pick", "What is under a pixel of the picture");
    const CLI::Option* pickX = pick->add_option("X", in.pick.xPx, "From the left");
    const CLI::Option* pickY = pick->add_option("Y", in.pick.yPx, "From the top");
    pick->add_option("--wand", in.pick.wand, "What this wand points at instead")->type_name("NAME");

    CLI::App* measure = app.add_subcommand("measure", "How far it is from a place to a place, or to a node");
    measure->add_option("FROM", in.measureFrom, "X,Y,Z in the world; or a node: its nearest surface")->required();
    measure->add_option("TO", in.measureTo, "The same; one of the two is a place")->required();

    CLI::App* drag = app.add_subcommand("drag", "Takes hold of a manipulator's handle, and leads it");
    drag->add_option("PLACES", in.drag.at, "Pixels X Y: of the handle, and where to")->required()->check(numberFault);
    drag->add_flag("--rays", in.drag.rays, "Places are rays: origin, direction (X Y Z each)");
    drag->add_option("--steps", in.drag.steps, "Edits from one place to the next")->check(CLI::Range(1, 1000));

    const CLI::App* animations = app.add_subcommand("animations", "What plays, or could; its time and length in s");
    const auto ofAnimation = [&](const char* verb, const char* what) {
        CLI::App* one = app.add_subcommand(verb, what);
        one->add_option("NODE", in.take.node, "An animation's; tessera-ctl animations lists them")->required();
        return one;
    };
    const CLI::App* playOne = ofAnimation("play", "An animation goes on from where it is");
    const CLI::App* pauseOne = ofAnimation("pause", "An animation stands");
    CLI::App* seek = ofAnimation("seek", "An animation shows another time");
    seek->add_option("SECONDS", in.seconds, "From its beginning; beyond an end it stays there, or\ngoes round")->required()->check(numberFault);
    CLI::App* speedOf = ofAnimation("speed", "How fast an animation plays");
    speedOf->add_option("FACTOR", in.speed, "1: as made; below 0: backwards")->required()->check(numberFault);

    const CLI::App* inlines = app.add_subcommand("inlines", "Files that nodes hold: which load, which failed");

    CLI::App* files = app.add_subcommand("files", "What lies in the server's folders that load reads");
    files->add_option("FOLDER", in.files.folder, "One of them, or below one; without it they are listed");

    const CLI::App* trackers = app.add_subcommand("trackers", "What the wall's trackers say, and how well");

    CLI::App* play = app.add_subcommand("play-tracker", "Sends poses as a tracker would; needs no server");
    play->add_option("TO", in.play.to, "HOST:PORT, where a wall's tracker listens")->required();
    play->add_option("FILE", in.play.file, "Lines of TIME X Y Z [QW QX QY QZ], metres (a circle)");
    play->add_option("--protocol", in.playProtocol, "dtrack or osc (dtrack)")->check(CLI::IsMember({"dtrack", "osc"}));
    play->add_option("--sensor", in.play.sensor, "The body's number (0)")->type_name("N")->check(CLI::Range(0, 65535));
    play->add_flag("--flystick", in.play.flystick, "A flystick instead of a body; DTrack");
    play->add_option("--buttons", in.play.buttons, "Pressed, 1 + 2 + 4 …; with --flystick")
        ->type_name("BITS")
        ->check(CLI::Range(0, 255));
    play->add_option("--rate", in.play.rateHz, "Poses a second (60)")->type_name("HZ")->check(CLI::Range(0.1, 1000.0))->check(numberFault);
    play->add_option("--seconds", in.play.seconds, "So long (10); 0: until interrupted")
        ->type_name("S")
        ->check(CLI::Range(0.0, 1e6))
        ->check(numberFault);

    const CLI::App* newWall = addNewWall(app, in.newWall);

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

    const CLI::App* questions = app.add_subcommand("questions", "What stopped motions wait for");

    CLI::App* respond = app.add_subcommand("answer", "Decides a question");
    respond->add_option("ID", in.respond.question, "The question's number")->required();
    respond->add_option("DECISION", in.decision, "stop, pass or move")->required();
    respond->add_option("PLACE", in.respondTo, "Where to, with move")->type_name("X Y Z")->expected(0, 3)->check(numberFault);

    CLI::App* picture = app.add_subcommand("show", "The scene, or the test picture, on all tiles");
    picture->add_option("WHAT", in.picture, "scene or test-picture")->required()->check(CLI::IsMember({"scene", "test-picture"}).description(""));
    picture->add_flag("--count", in.count, "With test-picture: the number of each frame");

    CLI::App* budget = app.add_subcommand("budget", "Milliseconds that a frame may take before detail goes");
    budget->add_option("MS", in.budget, "A number, or off; without it what there is is told");

    CLI::App* snapshot = app.add_subcommand("snapshot", "The wall as it is now, as a picture");
    snapshot->add_option("FILE", in.snapshot.file, "FILE.png to write")->required();

    CLI::App* save = app.add_subcommand("save", "The scene as it is now, as a file of this machine");
    save->add_option("FILE", in.save.file, "FILE.tsc (binary) or FILE.tsct (text) to write, here\nand not at the server; it needs no other file but\nfilms, and scenes of Inline and ProxyGroup")
        ->required();

    try {
        std::vector<std::string> reversed = withPlainNumbers(words);
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
            if (const std::string fault = numberFault(word); word.starts_with('-') && fault.starts_with(word)) what = fault;
        return fail(ErrorCode::kUsage, fmt::format("{}; see tessera-ctl {}--help", what,
                                                   chosen.empty() ? "" : chosen.front()->get_name() + " "));
    }

    if (requests->parsed())
        return HelpText{in.asSchema ? applicationSchema() : in.line.json ? requestsLine() : requestsText()};
    if (types->parsed()) return HelpText{in.line.json ? jsonLine(typesJson()) : typesText()};
    in.line.timeout = std::chrono::milliseconds(static_cast<std::int64_t>(in.timeoutSeconds * 1000));
    const auto verb = [&]() -> Expected<Verb> {
        if (status->parsed()) return verb::Status{};
        if (whoAmI->parsed()) return verb::Who{};
        if (people->parsed()) return verb::People{};
        if (link->parsed())
            return verb::Link{in.role == "viewer"   ? Role::kViewer
                              : in.role == "editor" ? Role::kEditor
                                                    : Role::kOperator};
        if (tree->parsed()) return in.tree;
        if (load->parsed()) {
            Placing& placing = in.load.placing;
            if (*loadAt) placing.at = vector3(in.loadAt);
            if (*loadScale) placing.scale = in.loadScale;
            if (*loadFit) placing.fit = in.loadFit;
            if (*loadRadius) placing.pointRadius = in.loadRadius;
            if (!in.loadUp.empty()) placing.up = in.loadUp == "z" ? UpAxis::kZ : UpAxis::kY;
            if (const Expected<void> sound = checkPlacing(placing); !sound) return fail(ErrorCode::kUsage, "load: " + sound.error().message);
            return in.load;
        }
        if (move->parsed()) return moveVerb(in);
        if (set->parsed()) return in.set;
        if (get->parsed()) return in.get;
        if (remove->parsed()) return in.remove;
        if (clone->parsed()) {
            if (!in.clone.deep && !in.clone.share.empty())
                return fail(ErrorCode::kUsage, "clone: --share needs --deep: without it all cores are shared");
            return in.clone;
        }
        if (find->parsed()) return in.find;
        if (undo->parsed()) return verb::Undo{};
        if (steps->parsed()) return verb::Steps{};
        if (redo->parsed()) return verb::Redo{};
        if (view->parsed()) return viewVerb(in, scale->count() > 0);
        if (pick->parsed()) {
            const auto numbers = pickX->count() + pickY->count();
            if (in.pick.wand.empty() ? numbers != 2 : numbers != 0)
                return fail(ErrorCode::kUsage, "pick: say X and Y, or --wand NAME");
            return in.pick;
        }
        if (measure->parsed()) {
            Expected<verb::Measure> wanted = measureVerb(in.measureFrom, in.measureTo);
            if (!wanted) return tl::unexpected(wanted.error());
            return *wanted;
        }
        if (drag->parsed()) {
            const std::size_t each = in.drag.rays ? 6 : 2;
            if (in.drag.at.size() % each != 0 || in.drag.at.size() < 2 * each)
                return fail(ErrorCode::kUsage, fmt::format("drag: say two places or more, of {} numbers each", each));
            return in.drag;
        }
        if (files->parsed()) return in.files;
        if (trackers->parsed()) return verb::Trackers{};
        if (animations->parsed()) return verb::Animations{};
        if (inlines->parsed()) return verb::Inlines{};
        if (playOne->parsed() || pauseOne->parsed()) return verb::Play{.node = in.take.node, .playing = playOne->parsed(), .time = {}, .speed = {}};
        if (seek->parsed()) return verb::Play{.node = in.take.node, .playing = {}, .time = in.seconds, .speed = {}};
        if (speedOf->parsed()) return verb::Play{.node = in.take.node, .playing = {}, .time = {}, .speed = in.speed};
        if (play->parsed()) {
            in.play.osc = in.playProtocol == "osc";
            if (in.play.osc && in.play.flystick)
                return fail(ErrorCode::kUsage, "play-tracker: --flystick is DTrack's; OSC has bodies here");
            return in.play;
        }
        if (newWall->parsed()) return in.newWall;
        if (fly->parsed()) return verb::Fly{};
        if (navigate->parsed()) return navigateVerb(in);
        if (bookmark->parsed()) return verb::Navigate{bookmarkWish(in.bookmark, in.keep), {}};
        if (contacts->parsed()) return contactsVerb(in, frames->count() > 0);
        if (questions->parsed()) return verb::Questions{};
        if (respond->parsed()) return respondVerb(in);
        if (picture->parsed()) return showVerb(in);
        if (budget->parsed()) return budgetVerb(in);
        if (save->parsed()) {
            // Before the scene is fetched, not after it.
            const Expected<SceneEncoding> encoding = sceneEncodingOf(in.save.file);
            if (!encoding) return tl::unexpected(encoding.error());
            return in.save;
        }
        return in.snapshot;
    }();
    if (!verb) return tl::unexpected(verb.error());
    in.line.verb = *verb;
    return in.line;
}

}  // namespace tessera
