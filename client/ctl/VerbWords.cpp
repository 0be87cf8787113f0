#include "client/ctl/VerbWords.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>

#include "client/ctl/FieldText.h"
#include "client/ctl/NumberText.h"
#include "common/json/ApiJson.h"

namespace tessera {

namespace {

Expected<Quatd> quaternion(const std::vector<double>& wxyz, std::string_view option) {
    const Quatd q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if (!tellsRotation(q.squaredNorm()))
        return fail(ErrorCode::kUsage,
                    fmt::format("{}: its length is 0, or nearly, or beyond what numbers can hold", option));
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
Expected<Verb> moveVerb(const VerbWords& words) {
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

Expected<Verb> viewVerb(const VerbWords& words, bool scaleGiven) {
    ViewWish view;
    view.reset = words.reset;
    if (words.viewBy && (!words.lookAt.empty() || !words.head.empty() || words.reset))
        return fail(
            ErrorCode::kUsage,
            "view: --by goes with --position, --orientation and --scale: --look-at, --head and --reset say where, "
            "not how far");
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
    if (words.viewBy && !view.position && !view.orientation && !view.worldUnitsPerMetre && !view.reset)
        return fail(ErrorCode::kUsage, "view --by: say --position, --orientation or --scale");
    return verb::View{view, words.viewBy};
}

NavigationWish bookmarkWish(std::uint32_t number, bool keep) {
    using Deed = NavigationWish::Deed;
    return {.deed = keep ? Deed::kKeepBookmark : Deed::kGoToBookmark, .bookmark = number};
}

Expected<Verb> navigateVerb(const VerbWords& words) {
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
    return refuse(
        fmt::format("\"{}\" is nothing that can be asked for; write fly, orbit, walk, home, fit or bookmark", what));
}

Expected<Verb> contactsVerb(const VerbWords& words, bool framesGiven) {
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

Expected<Verb> showVerb(const VerbWords& words) {
    if (words.picture != "scene") return verb::Show{words.count ? Showing::kCountedTestPicture : Showing::kTestPicture};
    if (words.count) return fail(ErrorCode::kUsage, "show: --count is for the test picture");
    return verb::Show{};
}

Expected<Verb> budgetVerb(const VerbWords& words) {
    if (words.budget.empty()) return verb::Budget{};
    if (words.budget == "off") return verb::Budget{0.0};
    double number = 0;
    const auto [end, error] = std::from_chars(words.budget.data(), words.budget.data() + words.budget.size(), number);
    if (error != std::errc() || end != words.budget.data() + words.budget.size() || !isBudget(number))
        return fail(ErrorCode::kUsage,
                    fmt::format("budget: \"{}\" is none; write off, or 0.1 to 60000 milliseconds", words.budget));
    return verb::Budget{number};
}

Expected<Verb> exposureVerb(const VerbWords& words) {
    verb::Exposure exposure;
    if (words.exposure == "scene") {
        exposure.reset = true;
    } else if (!words.exposure.empty()) {
        const Expected<ExposureWish> wish = parseExposure(words.exposure);
        if (!wish) return failWith("exposure", wish.error());
        exposure.wish = *wish;
    }
    if (words.toneMap.empty()) return exposure;
    const Expected<ToneMap> toneMap = parseToneMap(words.toneMap);
    if (!toneMap) return failWith("exposure", toneMap.error());
    exposure.wish.toneMap = *toneMap;
    return exposure;
}

Expected<Verb> respondVerb(const VerbWords& words) {
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
}  // namespace tessera
