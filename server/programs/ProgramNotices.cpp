#include "server/programs/ProgramNotices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/MaterialGroup.h"
#include "common/cores/SurfaceParts.h"
#include "common/drawable/ProgramImages.h"
#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"
#include "server/programs/NoticeNodes.h"

namespace tessera {
namespace {

constexpr double kShareOfScreen = 1.0 / 40;  ///< an em, of the screen's height

/// As a Billboard of no axis turns what is below it: to the right, up, towards the head. In the world.
Mat3d facing(const Vec3d& towards) {
    const Vec3d across = Vec3d::UnitY().cross(towards);
    Mat3d turned;
    turned.col(2) = towards;
    turned.col(0) = across.norm() > 1e-9 ? Vec3d(across.normalized()) : Vec3d(Vec3d::UnitX());
    turned.col(1) = towards.cross(turned.col(0));
    return turned;
}

/// 0 in it.
double distanceTo(const Box& box, const Vec3d& place) {
    return (place - place.cwiseMax(box.lower).cwiseMin(box.upper)).norm();
}

/// Bad programs that a material is drawn with, its passes and what stands for it where it is small; and those of them
/// that are bad themselves.
void appendPrograms(const Aspect& scene, ObjectId material, const std::set<ObjectId>& bad,
                    std::vector<ObjectId>& found) {
    for (int i = 0; i < 8 && material; ++i) {
        const Material* one = scene.get<Material>(material);
        if (!one) return;
        const auto append = [&](ObjectId id, const Material& of) {
            if (bad.contains(of.program)) found.push_back(of.program);
            if (bad.contains(id)) found.push_back(id);
        };
        append(material, *one);
        for (std::size_t pass = 0; pass < one->passes.size(); ++pass)
            if (const auto* over = scene.get<Material>(one->passes[pass])) append(one->passes[pass], *over);
        material = one->coarser;
    }
}

}  // namespace

ProgramNotices::ProgramNotices(const Wall& wall) : wall_(wall) {
    const auto ofTwo = [](const TileAssignment& tile) { return tile.eye != Eye::kCenter; };
    for (const WallHost& host : wall_.hosts)
        if (std::ranges::any_of(host.tiles, ofTwo)) beforeEye_ = kBeforeTwoEyesMetres;
    beforeEye_ = std::max(beforeEye_, 1.2 * wall_.nearMetres);
}

void ProgramNotices::setBad(ObjectId id, bool isBad) {
    const bool changed = isBad ? bad_.insert(id).second : bad_.erase(id) > 0;
    if (!changed) return;
    lookDue_ = true;
    sinceLook_ = kPatience;
}

void ProgramNotices::lookAtMaterials(const Aspect& scene) {
    for (const ObjectId id : withPrograms_)
        setBad(id, uniformOfAnotherShape(scene, *scene.get<Material>(id)).has_value());
}

NoticeText ProgramNotices::wordsOf(const Aspect& scene, const Place& place) {
    const std::string path = pathOf(scene, place.node);
    if (const auto* program = scene.get<SurfaceProgram>(place.program))
        return noticeText(path, place.program, program->problem);
    const auto* material = scene.get<Material>(place.program);
    const auto* uniform =
        material ? scene.get<Uniform>(uniformOfAnotherShape(scene, *material).value_or(ObjectId())) : nullptr;
    if (!uniform) return noticeText(path, place.program, "");
    const bool cube = scene.get<Image>(uniform->image)->shape == Image::kCube;
    return noticeText(path, place.program,
                      fmt::format("its program is left out: the uniform \"{}\" has an image that is a {}, and programs "
                                  "read flat images alone",
                                  uniform->name, cube ? "cube" : "solid"),
                      "Material");
}

void ProgramNotices::update(const Aspect& scene, const ChangeList* list) {
    const auto lookAtProgram = [&](ObjectId id) {
        const auto* program = scene.get<SurfaceProgram>(id);
        setBad(id, program && (program->verdict == SurfaceProgram::kBad || program->verdict == SurfaceProgram::kHeavy));
    };
    const auto lookAtMaterial = [&](ObjectId id) {
        const auto* material = scene.get<Material>(id);
        if (material && material->program) {
            withPrograms_.insert(id);
        } else if (withPrograms_.erase(id) > 0) {
            setBad(id, false);
        }
    };
    const auto lookAtName = [&](ObjectId id) {
        const Node* node = scene.get<Node>(id);
        node && node->name == kProgramNoticesName ? (void)named_.insert(id) : (void)named_.erase(id);
    };
    if (!list) {
        bad_.clear();
        withPrograms_.clear();
        named_.clear();
        places_.clear();
        for (const ObjectId id : scene.ids()) {
            lookAtProgram(id);
            lookAtMaterial(id);
            lookAtName(id);
        }
        lookAtMaterials(scene);
        return;
    }
    bool tree = !list->placements.empty(), says = false;
    for (const FieldColumn& column : list->columns) {
        if (column.type == typeOf<Material>() && column.field == fieldId<&Material::program>)
            for (const ObjectId id : column.ids) lookAtMaterial(id);
        says = says ||
               (column.type == typeOf<Material>() &&
                (column.field == fieldId<&Material::program> || column.field == fieldId<&Material::uniforms>)) ||
               (column.type == typeOf<Uniform>() &&
                (column.field == fieldId<&Uniform::image> || column.field == fieldId<&Uniform::name>)) ||
               (column.type == typeOf<SurfaceProgram>() && (column.field == fieldId<&SurfaceProgram::surface> ||
                                                            column.field == fieldId<&SurfaceProgram::vertex>)) ||
               (column.type == typeOf<Image>() && column.field == fieldId<&Image::shape>);
        if (column.type == typeOf<SurfaceProgram>())
            for (const ObjectId id : column.ids) lookAtProgram(id);
        if (column.type == typeOf<Node>() && column.field == fieldId<&Node::name>)
            for (const ObjectId id : column.ids) lookAtName(id);
        const bool refers = column.kind() == FieldKind::kRef || column.kind() == FieldKind::kRefs;
        tree = tree || refers || (effectsOf(column) & (Effect::kStructure | Effect::kVisibility));
    }
    for (const ObjectId id : list->destructions) {
        lookAtProgram(id);
        lookAtMaterial(id);
        named_.erase(id);
    }
    if (says || !list->destructions.empty()) lookAtMaterials(scene);
    if (bad_.empty() || !tree) return;
    lookDue_ = true;
    // What is gone is seen to be gone at once.
    if (std::ranges::any_of(places_, [&](const Place& place) { return !scene.get<Node>(place.node); }))
        sinceLook_ = kPatience;
}

bool ProgramNotices::stillSees(const View& view) const {
    const Affine3d world_T_wall = view.world_T_wall();
    constexpr double kTurned = 0.02, kMoved = 0.25;  // in all, and of the way to the nearest
    const Mat3d turned =
        world_T_wall.linear() / view.worldUnitsPerMetre - eye_.world_T_wall.linear() / eye_.unitsPerMetre;
    const double moved = (world_T_wall * headOf(view) - eye_.world_T_wall * eye_.head).norm();
    const double larger = view.worldUnitsPerMetre / eye_.unitsPerMetre;
    return turned.cwiseAbs().maxCoeff() < kTurned && moved < kMoved * eye_.nearest * eye_.unitsPerMetre &&
           larger < 1.25 && larger > 0.8;
}

/// On the first screen's plane, as the first user's eye sees it from where stands were found last: those that are on
/// the screen are moved until all of them are, and up or down, as little as that takes, off those that come before.
void ProgramNotices::layOut(std::vector<WantedNotice>& wanted, const View& view) {
    if (wanted.empty()) return;
    const Screen& screen = wall_.screens.front();
    const Vec3d right = (screen.lowerRight - screen.lowerLeft).normalized(),
                up = (screen.upperLeft - screen.lowerLeft).normalized();
    const Vec3d normal = right.cross(up);
    if (laidFor_ != wanted.size() || standsMoved_ || !stillSees(view)) {
        User user = wall_.users.front();
        user.position = headOf(view);
        const ScreenCamera camera = screenCamera(screen, user, Eye::kCenter, view);
        const PixelRect whole{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
        eye_ = {.world_T_wall = view.world_T_wall(),
                .wall_T_world = view.world_T_wall().inverse(),
                .head = user.position,
                .unitsPerMetre = view.worldUnitsPerMetre,
                .sees = tileFrustum(camera, whole, 0),
                .nearest = 0};
    }
    standsMoved_ = false;
    laidFor_ = wanted.size();
    constexpr double kRoomAround = 1.1, kNearestMetres = 0.3, kDearerDown = 3, kShareOfFree = 0.7;
    const Vec3d& head = eye_.head;
    const double before = normal.dot(screen.lowerLeft - head), width = screen.widthMetres(),
                 height = screen.heightMetres();
    struct Laid {
        double x, y, halfWidth, halfHeight;
        [[nodiscard]] bool meets(const Laid& other) const {
            return std::abs(x - other.x) < halfWidth + other.halfWidth &&
                   std::abs(y - other.y) < halfHeight + other.halfHeight;
        }
    };
    /// From the screen's corner to where it is seen on it; nothing where it is not.
    const auto seenOn = [&](const Vec3d& way) -> std::optional<Vec3d> {
        const double t = before / normal.dot(way);
        if (!(t > 0 && t < 1e9)) return std::nullopt;  // behind the eye, or beside the screen
        const Vec3d on = head + t * way - screen.lowerLeft;
        const double x = right.dot(on), y = up.dot(on);
        return x >= 0 && x <= width && y >= 0 && y <= height ? std::optional<Vec3d>(on) : std::nullopt;
    };
    const Vec3d toMiddle = screen.lowerLeft + 0.5 * (width * right + height * up) - head;
    struct Seen {
        Vec3d way;  ///< m, from the head, on the wall
        Vec3d on;   ///< from the screen's corner
    };
    // All as near as the nearest, so that none stands behind what another is of; not in the eye.
    double nearest = std::numeric_limits<double>::infinity(), nearestOfAny = nearest;
    std::vector<std::optional<Seen>> ways;
    for (WantedNotice& one : wanted) {
        std::optional<Seen>& seen = ways.emplace_back();
        Vec3d way =
            one.close ? Vec3d(eye_.wall_T_world * one.of.center() - head) : Vec3d(eye_.wall_T_world * one.at - head);
        std::optional<Vec3d> on = seenOn(way);
        nearestOfAny = std::min(nearestOfAny, way.norm());
        const double free = distanceTo(one.of, eye_.world_T_wall * head) / eye_.unitsPerMetre;
        if (!on && (free == 0 || !eye_.sees.classify(one.of).outside)) {
            way = one.close ? toMiddle : Vec3d(way.norm() / toMiddle.norm() * toMiddle);
            on = seenOn(way);
        }
        if (!on) continue;
        if (one.close) {
            way *= std::max(beforeEye_ / std::abs(normal.dot(way)), kShareOfFree * free / way.norm());
            one.em = way.norm() * screenHeightFrom(head) * kShareOfScreen * eye_.unitsPerMetre;
        }
        seen = Seen{way, *on};
        nearest = std::min(nearest, one.close ? way.norm() : std::max(way.norm(), kNearestMetres));
    }
    eye_.nearest = std::isfinite(nearest) ? nearest : nearestOfAny;
    std::vector<Laid> all;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (!ways[i]) continue;
        WantedNotice& one = wanted[i];
        auto [way, on] = *ways[i];
        const double share = std::min(1.0, nearest / way.norm());
        way *= share;
        one.em *= share;
        const double t = before / normal.dot(way);
        // Turned to the eye it is no rectangle there: the one around it, and a little more, as it grows on its way to
        // the screen's edge.
        const Vec3d size = one.em / eye_.unitsPerMetre * one.plateSize();
        const Mat3d turned =
            eye_.wall_T_world.linear() * eye_.unitsPerMetre * facing(-(eye_.world_T_wall.linear() * way).normalized());
        Laid laid{right.dot(on), up.dot(on), 0, 0};
        for (const double sx : {-0.5, 0.5})
            for (const double sy : {-0.5, 0.5}) {
                const Vec3d corner = way + sx * size.x() * turned.col(0) + sy * size.y() * turned.col(1);
                const Vec3d there = before / normal.dot(corner) * corner + head - screen.lowerLeft;
                laid.halfWidth = std::max(laid.halfWidth, kRoomAround * std::abs(right.dot(there) - laid.x));
                laid.halfHeight = std::max(laid.halfHeight, kRoomAround * std::abs(up.dot(there) - laid.y));
            }
        const auto within = [](double at, double half, double most) {
            return 2 * half < most ? std::clamp(at, half, most - half) : 0.5 * most;
        };
        laid.x = within(laid.x, laid.halfWidth, width);
        laid.y = within(laid.y, laid.halfHeight, height);
        Laid best = laid;
        double least = std::numeric_limits<double>::infinity();
        const auto attempt = [&](double y) {
            Laid there = laid;
            there.y = y;
            const bool onScreen = y == laid.y || (y >= laid.halfHeight && y <= height - laid.halfHeight);
            // Rather up: below there are floors.
            const double far = y < laid.y ? kDearerDown * (laid.y - y) : y - laid.y;
            if (!onScreen || far >= least ||
                std::ranges::any_of(all, [&](const Laid& other) { return there.meets(other); }))
                return;
            best = there;
            least = far;
        };
        attempt(laid.y);
        for (const Laid& other : all)
            for (const double side : {1.0, -1.0})
                attempt(other.y + side * (1 + 1e-9) * (other.halfHeight + laid.halfHeight));
        all.push_back(best);
        const Vec3d to = screen.lowerLeft + best.x * right + best.y * up;
        one.at = eye_.world_T_wall * Vec3d(head + (to - head) / t);
    }
}

Vec3d ProgramNotices::headOf(const View& view) const {
    const User& user = wall_.users.front();
    const User* there = view.findUser(user.name);
    return (there ? *there : user).position;
}

double ProgramNotices::screenHeightFrom(const Vec3d& head) const {
    const Screen& screen = wall_.screens.front();
    const Vec3d normal = (screen.lowerRight - screen.lowerLeft).cross(screen.upperLeft - screen.lowerLeft).normalized();
    return screen.heightMetres() / std::max(0.05, std::abs(normal.dot(head - screen.lowerLeft)));
}

void ProgramNotices::look(const Aspect& scene) {
    places_.clear();
    visited_ = 0;
    std::set<ObjectId> wanted;
    for (const ObjectId id : bad_)
        if (wanted.size() < kMost) wanted.insert(id);
    std::vector<ObjectId> found;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (wanted.empty() || ++visited_ > kMostVisited || visit.node.ofServer) return Descend::kPast;
        const MaterialGroup* group = visit.core.as<MaterialGroup>();
        const Drawable drawable = drawableOf(visit.core);
        if (!group && !drawable) return Descend::kInto;
        found.clear();
        appendPrograms(scene, group ? group->material : drawable.material(), wanted, found);
        for (const ObjectId program : found) {
            if (wanted.erase(program) == 0) continue;
            Place place{.program = program, .node = visit.nodeId, .key = {}, .local = {}, .world = {}};
            if (group) place.world = sceneBounds(scene, visit.nodeId);
            if (!group || !place.world.empty()) places_.push_back(std::move(place));
        }
        return Descend::kInto;
    });
    action.run(scene);
    std::ranges::sort(places_, {}, &Place::program);
    std::erase_if(stands_, [&](const auto& stand) {
        return std::ranges::find(places_, stand.first, &Place::program) == places_.end();
    });
}

/// What they are of moves, and bends.
void ProgramNotices::follow(const Aspect& scene) {
    for (Place& place : places_) {
        const Node* node = scene.get<Node>(place.node);
        const Drawable drawable = node ? drawableOf(scene, *node) : Drawable();
        if (!drawable) continue;  // a group's bounds are of the last look
        if (const MeshKey key = drawable.key(); key != place.key || place.local.empty()) {
            place.key = key;
            place.local = drawable.bounds();
        }
        place.world = place.local.empty() ? Box() : place.local.transformed(worldTransform(scene, place.node));
    }
}

ProgramNotices::Stand ProgramNotices::standOf(const Place& place, const View& view) {
    const Vec3d head = headOf(view);
    const Vec3d eye = view.world_T_wall() * head, way = eye - place.world.center();
    const double height = screenHeightFrom(head);
    const double distance = std::max(way.norm(), 1e-9), radius = 0.51 * place.world.size().norm();
    Stand wanted{.towards = way.norm() > 1e-9 ? Vec3d(way / way.norm()) : Vec3d(Vec3d::UnitZ()),
                 .away = std::min(radius, 0.5 * distance),
                 .em = 0};
    const auto known = stands_.find(place.program);
    // Beyond twice the radius what is a radius away is before all of it; nearer it may be within.
    wanted.close = distance < (known != stands_.end() && known->second.close ? 2.2 : 2.0) * radius;
    if (known != stands_.end()) {
        Stand& stand = known->second;
        constexpr double kNearEnough = 1.25, kCosine = 0.97;  // about 14 degrees
        const auto keeps = [](double now, double then) {
            return now <= then * kNearEnough && then <= now * kNearEnough;
        };
        if (stand.towards.dot(wanted.towards) > kCosine) wanted.towards = stand.towards;
        if (keeps(wanted.away, stand.away)) wanted.away = stand.away;
    }
    wanted.em = std::max(distance - wanted.away, 0.05 * view.worldUnitsPerMetre) * height * kShareOfScreen;
    if (known != stands_.end()) {
        const double then = known->second.em;
        if (wanted.em <= then * 1.25 && then <= wanted.em * 1.25) wanted.em = then;
    }
    Stand& stand = stands_[place.program];
    standsMoved_ = standsMoved_ || stand.towards != wanted.towards || stand.away != wanted.away ||
                   stand.em != wanted.em || stand.close != wanted.close;
    stand = wanted;
    return wanted;
}

std::vector<ObjectId> ProgramNotices::tops(const Aspect& scene) const {
    std::vector<ObjectId> all;
    for (const ObjectId id : named_)
        if (scene.get<Node>(id)->ofServer) all.push_back(id);
    return all;
}

ChangeList ProgramNotices::notices(const Aspect& scene, const View& view) {
    if ((bad_.empty() && named_.empty()) || wall_.users.empty() || wall_.screens.empty()) return {};
    sinceLook_ = std::min(sinceLook_ + 1, kPatience + 1);
    if (bad_.empty()) places_.clear();
    if (!bad_.empty() && lookDue_ && sinceLook_ > kPatience) {
        lookDue_ = false;
        sinceLook_ = 0;
        look(scene);
    }
    follow(scene);
    std::vector<WantedNotice> wanted;
    for (const Place& place : places_) {
        if (!bad_.contains(place.program) || !scene.get<Node>(place.node) || place.world.empty()) continue;
        if (!place.world.lower.allFinite() || !place.world.upper.allFinite()) continue;
        const Stand stand = standOf(place, view);
        const Vec3d at = place.world.center() + stand.away * stand.towards;
        if (!at.allFinite() || !(stand.em > 1e-12 && stand.em < 1e12)) continue;
        NoticeText words = wordsOf(scene, place);
        wanted.push_back(
            {.words = std::move(words), .at = at, .em = stand.em, .of = place.world, .close = stand.close});
    }
    if (bad_.size() > kMost && !wanted.empty()) {
        NoticeText& last = wanted.back().words;
        const std::string more = fmt::format("and {} bad programs more", bad_.size() - kMost);
        last.text += "\n" + more;
        ++last.lines;
        last.columns = std::max(last.columns, more.size());
    }

    layOut(wanted, view);

    ChangeListBuilder list;
    std::vector<ObjectId> going = tops(scene);
    if (!going.empty() && !wanted.empty()) {
        const ObjectId top = going.front();
        const std::optional<std::vector<PresentNotice>> present = readNotices(scene, *scene.get<Node>(top));
        if (present && present->size() == wanted.size()) {
            for (std::size_t i = 0; i < wanted.size(); ++i) setNotice(scene, list, (*present)[i], wanted[i]);
            if (!noticesAreLast(scene, top)) list.place(top, kRootNode);
            going.erase(going.begin());
            wanted.clear();
        }
    }
    std::vector<ObjectId> gone;
    for (const ObjectId top : going) {
        const std::vector<ObjectId> others = othersBelow(scene, *scene.get<Node>(top));
        for (const ObjectId id : others) list.place(id, kRootNode);
        if (others.empty()) gone.push_back(top);  // else once they are out of the way
    }
    if (!gone.empty()) {
        ChangeList removal = removalOf(scene, gone);
        for (const Placement& placement : removal.placements)
            list.place(placement.node, placement.parent, placement.index);
        for (const ObjectId id : removal.destructions) list.destroy(id);
    }
    if (!wanted.empty() && gone.size() == going.size()) buildNotices(scene, list, wanted);
    return list.take();
}

std::vector<Blob> ProgramNotices::blobs() {
    return {noticePlate().positions, noticePlate().normals, noticePlate().indices};
}

}  // namespace tessera
