// What nodes hold beside geometry: letters, lights, viewpoints, backgrounds.

#include <Inventor/VRMLnodes/SoVRML.h>
#include <Inventor/VRMLnodes/SoVRMLNodes.h>
#include <Inventor/elements/SoModelMatrixElement.h>
#include <Inventor/nodes/SoNodes.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/Utf8.h"
#include "common/math/Srgb.h"
#include "server/import/coin/CoinNodes.h"
#include "server/import/coin/CoinWalk.h"

namespace tessera {
namespace {

/// Turns -Z to a direction; none: as it is.
Quatd towards(const SbVec3f& direction) {
    const Vec3d d = vectorOf(direction);
    return d.allFinite() && d.norm() > 1e-12 ? Quatd::FromTwoVectors(-Vec3d::UnitZ(), d.normalized()).normalized()
                                             : Quatd::Identity();
}

/// UTF-8 as it is; what else a file has would be refused.
std::string lettersOf(const SbString& text) {
    std::string letters = text.getString();
    std::ranges::replace_if(
        letters, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    return letters;
}

std::string linesOf(const SoMFString& lines) {
    std::string all;
    for (int i = 0; i < lines.getNum(); ++i) all += (i > 0 ? "\n" : "") + lettersOf(lines[i]);
    return all;
}

constexpr float kDegrees = static_cast<float>(180.0 / std::numbers::pi);

}  // namespace

/// As the server sets it, in its own fonts.
Expected<void> CoinWalk::addText(const SoNode& node, const CoinMaterials::Wanted& wanted, Place& at) {
    proto::scene::Text text;
    using T = proto::scene::Text;
    double size = 1, spacing = 1, drop = 0;  // how far the first baseline is below the origin, in sizes
    if (is<SoVRMLText>(node)) {
        const auto& source = as<SoVRMLText>(node);
        text.set_text(linesOf(source.string));
        if (source.length.getNum() > 0 || source.maxExtent.getValue() > 0)
            scene_.note("lengths of a Text are left out: letters are as wide as their font has them");
        if (const SoNode* style = source.fontStyle.getValue(); style != nullptr && is<SoVRMLFontStyle>(*style)) {
            const auto& font = as<SoVRMLFontStyle>(*style);
            size = font.size.getValue();
            spacing = font.spacing.getValue();
            const std::string family = font.family.getNum() > 0 ? font.family[0].getString() : "";
            const std::string face = font.style.getNum() > 0 ? font.style[0].getString() : "";
            std::string name = family == "SANS" ? "sans" : family == "TYPEWRITER" ? "mono" : "serif";
            if (face.find("BOLD") != face.npos) name += ":bold";
            if (face.find("ITALIC") != face.npos) name += ":italic";
            text.set_font(name);
            const auto justified = [&](int which) {
                return font.justify.getNum() > which ? std::string(font.justify[which].getString()) : std::string();
            };
            const std::string along = justified(0), across = justified(1);
            text.set_alignment(along == "MIDDLE" ? T::CENTER : along == "END" ? T::RIGHT : T::LEFT);
            const double lines = std::max(0, source.string.getNum() - 1) * spacing;
            drop = across == "BEGIN" ? 0.8 : across == "MIDDLE" ? 0.4 - 0.5 * lines : across == "END" ? -lines : 0;
            if (!font.horizontal.getValue()) scene_.note("a Text that runs downwards is written along a line");
        } else {
            text.set_font("serif");
        }
    } else {
        size = action_.getFontSize();
        const std::string family = action_.getFontName().getString();
        if (!family.starts_with("default")) text.set_font(family.substr(0, family.find(':')));
        int along = SoAsciiText::LEFT;
        if (is<SoAsciiText>(node)) {
            const auto& source = as<SoAsciiText>(node);
            text.set_text(linesOf(source.string));
            along = source.justification.getValue();
            spacing = source.spacing.getValue();
        } else if (is<SoText3>(node)) {
            const auto& source = as<SoText3>(node);
            text.set_text(linesOf(source.string));
            along = source.justification.getValue();
            spacing = source.spacing.getValue();
            if ((source.parts.getValue() & SoText3::SIDES) != 0) text.set_depth(1);
        } else {
            const auto& source = as<SoText2>(node);
            text.set_text(linesOf(source.string));
            along = source.justification.getValue();
            spacing = source.spacing.getValue();
            scene_.note("a Text2, whose letters have a size on the screen, has one in the scene");
        }
        text.set_alignment(along == SoAsciiText::CENTER ? T::CENTER : along == SoAsciiText::RIGHT ? T::RIGHT : T::LEFT);
    }
    if (text.text().find_first_not_of(" \n") == std::string::npos) return {};
    if (!(size > 1e-9 && size <= 1e9) || !(std::abs(spacing) <= 100) || text.text().size() > 65536) {
        leaveOut("a Text whose size, spacing or length is out of bounds", node);
        return {};
    }
    text.set_size(size);
    text.set_line_spacing(spacing);
    text.set_material(materials_.name(wanted));
    const SbMatrix before = SoModelMatrixElement::get(action_.getState());
    SbMatrix moved;
    moved.setTranslate(SbVec3f(0, static_cast<float>(-drop * size), 0));
    SoModelMatrixElement::mult(action_.getState(), nullptr, moved);
    Expected<Opened> opened = open(node, "Text", at);
    SoModelMatrixElement::set(action_.getState(), nullptr, before);
    if (!opened || opened->node == nullptr) return opened ? Expected<void>() : tl::unexpected(opened.error());
    if (Expected<void> room = takeNode(); !room) return room;
    bounds_.extend(opened->place.world.translation());
    Message* child = opened->node->add_node();
    if (is<SoText2>(node)) {
        child->set_name("billboard");
        child->mutable_billboard()->set_point(true);
        child = child->add_node();
    }
    child->set_name("letters");
    *child->mutable_text() = std::move(text);
    return {};
}

Expected<void> CoinWalk::addLight(const SoNode& node, Place& at) {
    const bool vrml2 = is<SoVRMLLight>(node);
    SbVec3f where(0, 0, 0), direction(0, 0, -1), attenuation(1, 0, 0);
    SbColor color = vrml2 ? as<SoVRMLLight>(node).color.getValue() : as<SoLight>(node).color.getValue();
    float intensity = vrml2 ? as<SoVRMLLight>(node).intensity.getValue() : as<SoLight>(node).intensity.getValue();
    const bool on = (vrml2 ? as<SoVRMLLight>(node).on : as<SoLight>(node).on).getValue() != FALSE;
    float radius = 0, inner = 0, outer = 0;
    enum { kDirectional, kPoint, kSpot } kind = kDirectional;
    if (is<SoVRMLDirectionalLight>(node)) {
        direction = as<SoVRMLDirectionalLight>(node).direction.getValue();
    } else if (is<SoVRMLPointLight>(node)) {
        kind = kPoint;
        where = as<SoVRMLPointLight>(node).location.getValue();
        attenuation = as<SoVRMLPointLight>(node).attenuation.getValue();
        radius = as<SoVRMLPointLight>(node).radius.getValue();
    } else if (is<SoVRMLSpotLight>(node)) {
        const auto& spot = as<SoVRMLSpotLight>(node);
        kind = kSpot;
        where = spot.location.getValue();
        direction = spot.direction.getValue();
        attenuation = spot.attenuation.getValue();
        radius = spot.radius.getValue();
        outer = spot.cutOffAngle.getValue();
        inner = std::min(spot.beamWidth.getValue(), outer);
    } else if (is<SoDirectionalLight>(node)) {
        direction = as<SoDirectionalLight>(node).direction.getValue();
    } else if (is<SoPointLight>(node)) {
        kind = kPoint;
        where = as<SoPointLight>(node).location.getValue();
    } else if (is<SoSpotLight>(node)) {
        const auto& spot = as<SoSpotLight>(node);
        kind = kSpot;
        where = spot.location.getValue();
        direction = spot.direction.getValue();
        outer = spot.cutOffAngle.getValue();
    } else {
        leaveOut(kindOf(node), node);
        return {};
    }
    const bool sound = intensity >= 0 && intensity <= 1e6f && vectorOf(where).cwiseAbs().maxCoeff() <= 1e15 &&
                       vectorOf(attenuation).minCoeff() >= 0 && vectorOf(attenuation).maxCoeff() <= 1e12 &&
                       radius >= 0 && std::isfinite(radius);
    if (!sound) {
        leaveOut("a light whose numbers are out of bounds", node);
        return {};
    }
    SoState& state = *action_.getState();
    const SbMatrix before = SoModelMatrixElement::get(&state);
    SbMatrix place;
    const Quatd turn = towards(direction);
    place.setTransform(where,
                       SbRotation(static_cast<float>(turn.x()), static_cast<float>(turn.y()),
                                  static_cast<float>(turn.z()), static_cast<float>(turn.w())),
                       SbVec3f(1, 1, 1));
    SoModelMatrixElement::mult(&state, nullptr, place);
    const std::string parent = at.path;
    Message* made = nullptr;
    if (scene_.file.by_tessera() && modelMatrix().isApprox(Affine3d::Identity(), 0.0)) {
        if (Expected<void> room = takeNode(); !room) return room;
        made = make(calledName(node), at);
        SoModelMatrixElement::set(&state, nullptr, before);
    } else {
        Expected<Opened> opened = open(node, "light", at);
        SoModelMatrixElement::set(&state, nullptr, before);
        if (!opened || opened->node == nullptr) return opened ? Expected<void>() : tl::unexpected(opened.error());
        if (Expected<void> room = takeNode(); !room) return room;
        made = opened->node->add_node();
        made->set_name("source");
    }
    Message& light = *made;
    const auto fill = [&](auto& message) {
        message.mutable_color()->set_r(linearOfSrgb(std::clamp(color[0], 0.0f, 1.0f)));
        message.mutable_color()->set_g(linearOfSrgb(std::clamp(color[1], 0.0f, 1.0f)));
        message.mutable_color()->set_b(linearOfSrgb(std::clamp(color[2], 0.0f, 1.0f)));
        message.set_intensity(intensity);
        message.set_on(on);
    };
    const auto fade = [&](auto& message) {
        message.mutable_attenuation()->set_x(attenuation[0]);
        message.mutable_attenuation()->set_y(attenuation[1]);
        message.mutable_attenuation()->set_z(attenuation[2]);
        message.set_range(vrml2 ? radius : 0);
    };
    if (kind == kDirectional) {
        fill(*light.mutable_directional_light());
        // VRML 2's lights what is below the group that it is in; ours were for all.
        if (vrml2 && !parent.empty() && !scene_.file.by_tessera()) light.mutable_directional_light()->set_scope(parent);
    } else if (kind == kPoint) {
        fill(*light.mutable_point_light());
        fade(*light.mutable_point_light());
    } else {
        fill(*light.mutable_spot_light());
        fade(*light.mutable_spot_light());
        const float most = 90.0f;
        light.mutable_spot_light()->set_outer_angle_deg(std::clamp(outer * kDegrees, 0.1f, most));
        light.mutable_spot_light()->set_inner_angle_deg(std::clamp(inner * kDegrees, 0.0f, most));
    }
    motion_.addTarget(node, light);
    return {};
}

Expected<void> CoinWalk::addView(const SoNode& node, Place& at) {
    SbVec3f where(0, 0, 0);
    SbRotation turn = SbRotation::identity();
    View view;
    std::string name = calledName(node);
    double angle = 0;
    if (is<SoVRMLViewpoint>(node)) {
        const auto& source = as<SoVRMLViewpoint>(node);
        where = source.position.getValue();
        turn = source.orientation.getValue();
        angle = source.fieldOfView.getValue();
        constexpr std::size_t kLongestWords = 100;
        std::string words(cutUtf8(lettersOf(source.description.getValue()), kLongestWords));
        std::ranges::replace(words, '/', '_');
        if (!words.empty() && !scene_.file.by_tessera()) name = words;
    } else {
        const auto& source = as<SoCamera>(node);
        where = source.position.getValue();
        turn = source.orientation.getValue();
        if (is<SoPerspectiveCamera>(node)) angle = as<SoPerspectiveCamera>(node).heightAngle.getValue();
        if (is<SoOrthographicCamera>(node)) {
            view.height = as<SoOrthographicCamera>(node).height.getValue();
            scene_.note("an orthographic camera is shown in perspective");
        }
    }
    if (angle > 0 && angle < std::numbers::pi) view.perDistance = 2 * std::tan(angle / 2);
    if (view.perDistance == 0 && !(view.height > 0)) {
        leaveOut("a viewpoint that shows nothing", node);
        return {};
    }
    SoState& state = *action_.getState();
    const SbMatrix before = SoModelMatrixElement::get(&state);
    SbMatrix place;
    place.setTransform(where, turn, SbVec3f(1, 1, 1));
    SoModelMatrixElement::mult(&state, nullptr, place);
    const Affine3d map = modelMatrix();
    SoModelMatrixElement::set(&state, nullptr, before);
    if (!(map.matrix().cwiseAbs().maxCoeff() <= 1e15)) {
        leaveOut("a viewpoint that is nowhere", node);
        return {};
    }
    if (name.empty()) name = "viewpoint";
    const bool moves = motion_.drives(node, "position") || motion_.drives(node, "orientation");
    Expected<Opened> opened = moves ? openMoving(node, name, at) : openAt(name, map, at);
    SoModelMatrixElement::set(&state, nullptr, before);
    if (!opened || opened->node == nullptr) return opened ? Expected<void>() : tl::unexpected(opened.error());
    if (Expected<void> room = takeNode(); !room) return room;
    if (moves) {
        float x = 0, y = 0, z = 0, w = 1;
        turn.getValue(x, y, z, w);
        const Quatd turned(w, x, y, z);
        setTransform(*opened->node->mutable_transform(), vectorOf(where), turned, Vec3d::Ones());
        opened->place.world = opened->place.world * Eigen::Translation3d(vectorOf(where)) * turned;
        motion_.addTarget(node, *opened->node);
    }

    view.wall = opened->node->add_node();
    view.wall->set_name("wall");
    view.world = opened->place.world;
    views_.push_back(view);
    return {};
}

/// The first is what VRML binds. Of a sky of several colours the one of the horizon is behind everything. None of them
/// gives light.
void CoinWalk::addBackground(const SoNode& node) {
    const auto& source = as<SoVRMLBackground>(node);
    if (hasBackground_) return leaveOut("Background beyond the first", node);
    hasBackground_ = true;
    for (const char* picture : {"backUrl", "bottomUrl", "frontUrl", "leftUrl", "rightUrl", "topUrl"})
        if (const SoField* const field = node.getField(picture);
            field != nullptr && static_cast<const SoMFString*>(field)->getNum() > 0) {
            leaveOut("pictures of a Background", node);
            break;
        }
    const auto set = [](proto::scene::Color& to, const SbColor& from) {
        to.set_r(linearOfSrgb(std::clamp(from[0], 0.0f, 1.0f)));
        to.set_g(linearOfSrgb(std::clamp(from[1], 0.0f, 1.0f)));
        to.set_b(linearOfSrgb(std::clamp(from[2], 0.0f, 1.0f)));
    };
    const int skies = source.skyColor.getNum();
    if (skies == 0) return;
    const SbColor horizon = source.skyColor[skies - 1];
    const int grounds = source.groundColor.getNum();
    // At the top, where whoever takes the file in looks for it.
    Message* const environment = scene_.file.add_node();
    environment->set_name("background");
    proto::scene::Environment& message = *environment->mutable_environment();
    set(*message.mutable_background(), horizon);
    if (skies > 1 || grounds > 0) scene_.note("a Background of several colours is the one of its horizon");
}

}  // namespace tessera
