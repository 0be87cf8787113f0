/// What tessera-ctl was asked to do.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/application/Application.h"
#include "common/base/Error.h"
#include "common/export/Export.h"

namespace tessera {

namespace verb {

struct Status {};
/// As whom the server knows us.
struct Who {};
struct People {};
/// Where browsers come in at a server of this machine, in a role.
struct Link {
    Role role = Role::kOperator;
};
/// The wall's figures, drawn anew all the time.
struct Top {
    double everySeconds = 1;
};
/// What happens to the wall, a line each.
struct Watch {
    double seconds = 0;  ///< 0: until interrupted
};
/// Frames as events, in a file.
struct Trace {
    std::string file;
    std::int64_t frames = 300;
    std::chrono::milliseconds patience{10'000};  ///< for the first frame
};
struct Tree {
    std::string node = "/";
    int depth = -1;  ///< levels below the node; -1: all
};
struct Load {
    std::string file;
    std::string under;  ///< a node; empty: the root
    Placing placing;
    bool reload = false;
    std::chrono::milliseconds patience{10'000};  ///< for its answer
};
struct Loads {};
struct Cancel {
    std::optional<std::uint64_t> load;  ///< absent: the only one
};
struct Move {
    std::string node;
    NodeMove move;
};
struct Set {
    std::string node, field;
    std::vector<std::string> values;
};
struct Get {
    std::string node, field;  ///< no field: all
};
struct Remove {
    std::string node;
};
struct Clone {
    std::string node;
    std::string under;  ///< a node; empty: beside the original
    std::string name;   ///< empty: the original's with a number behind it
    bool deep = false;
    std::vector<std::string> share;  ///< names of types, nodes and objects
};
struct Find {
    std::string expression;
    std::string under = "/";  ///< the expression's "/"
    std::string type;         ///< of cores; empty: any
    std::uint32_t pageSize = 256;
    std::int64_t limit = -1;  ///< nodes; -1: all
};
struct Materials {};
struct Undo {};
struct Redo {};
struct Steps {};
/// One that wants nothing asks where all is.
struct View {
    ViewWish view;
    bool by = false;  ///< from where the wall stands
};
/// What a key at a window would ask for. `node`: of a fit; empty: the whole scene.
struct Navigate {
    NavigationWish wish;
    std::string node;
};
/// The terminal's keys steer until one ends it.
struct Fly {};
struct Pick {
    double xPx = 0, yPx = 0;
    std::string wand;  ///< what it points at, instead of a pixel
};
/// How far it is from a place.
struct Measure {
    Vec3d from = Vec3d::Zero();
    std::optional<Vec3d> to;
    std::string node;  ///< instead of `to`: its nearest surface
};
/// Takes hold of a manipulator's handle, leads it from place to place, lets go.
struct Drag {
    std::vector<double> at;  ///< pixels, two each; of rays six each: origin and direction
    bool rays = false;
    std::uint32_t steps = 1;  ///< edits from one place to the next
};
struct Files {
    std::string folder;  ///< at the server; empty: those that may be looked into
};
struct Trackers {};
/// Sends datagrams as a tracker would; talks to no server.
struct PlayTracker {
    std::string to;    ///< HOST:PORT
    std::string file;  ///< empty: a circle
    bool osc = false;  ///< else DTrack
    int sensor = 0;
    bool flystick = false;
    std::uint32_t buttons = 0;         ///< of the flystick
    double rateHz = 60, seconds = 10;  ///< 0 s: until interrupted
};
/// Writes a wall file; talks to no server.
struct NewWall {
    std::string file;
    std::map<std::string, std::string> measures;  ///< by their names (NewWall.h); empty: not said
    bool force = false;
};
/// What touches in the newest frame. `show`: draw it instead.
struct Contacts {
    bool events = false, distances = false;  ///< these instead of the contacts themselves
    bool follow = false;                     ///< as they come; events unless distances alone are wanted
    bool stays = false;                      ///< with `follow`: events of pairs that go on touching too
    std::int64_t frames = 0;                 ///< with `follow`; 0: until interrupted
    std::int64_t limit = -1;                 ///< rows; -1: all
    std::optional<std::int64_t> show;        ///< bits of Interest::show
    std::string interest;                    ///< a node; empty: all
};
struct Animations {};
struct Inlines {};
/// One of them.
struct Play {
    std::string node;
    std::optional<bool> playing;
    std::optional<double> time, speed;
};
struct Questions {};
struct Respond {
    std::uint64_t question = 0;
    QuestionReply::Decision decision = QuestionReply::Decision::kStop;
    Vec3d place = Vec3d::Zero();  ///< with kMove: translation
};
struct Show {
    Showing showing = Showing::kScene;
};
/// Without a number it is told.
struct Budget {
    std::optional<double> milliseconds;
};
/// Without a wish, and not `reset`, it is told.
struct Exposure {
    ExposureWish wish;
    bool reset = false;
};
struct Snapshot {
    std::string file;
};
/// The whole scene, written here: arrays are fetched for it.
struct Save {
    std::string file;
    ExportOptions leaves;  ///< for a file of other programs
    bool foreign = false;
};

}  // namespace verb

using Verb =
    std::variant<verb::Status, verb::Who, verb::People, verb::Steps, verb::Link, verb::Tree, verb::Load, verb::Loads,
                 verb::Cancel, verb::Move, verb::Set, verb::Get, verb::Remove, verb::Undo, verb::Redo, verb::View,
                 verb::Navigate, verb::Fly, verb::Pick, verb::Measure, verb::Drag, verb::Contacts, verb::Questions,
                 verb::Respond, verb::Snapshot, verb::Save, verb::Trackers, verb::PlayTracker, verb::Show, verb::Budget,
                 verb::Exposure, verb::Animations, verb::Inlines, verb::Play, verb::Clone, verb::Find, verb::Files,
                 verb::Top, verb::Watch, verb::Trace, verb::Materials, verb::NewWall>;

struct CommandLine {
    std::string server, tokenFile, keys;
    bool json = false;
    std::chrono::milliseconds timeout{10'000};
    Verb verb;
};

/// A text to print instead of doing anything: --help, --version.
struct HelpText {
    std::string text;
};

/// `words` without the program's name. kUsage: says what is wrong and where help is.
[[nodiscard]] Expected<std::variant<CommandLine, HelpText>> parseCommandLine(const std::vector<std::string>& words);

}  // namespace tessera
