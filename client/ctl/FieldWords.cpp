#include "client/ctl/FieldWords.h"

#include <array>

namespace tessera {

namespace {

struct Word {
    TypeNumber type;
    FieldId field;
    std::int64_t number;
    std::string_view word;
};

constexpr std::array kWords{
    Word{TypeNumber::kSwitch, field::kChoice, Switch::kNone, "none"},
    Word{TypeNumber::kSwitch, field::kChoice, Switch::kAll, "all"},
    Word{TypeNumber::kMotion, field::kMotionMode, Motion::kOnce, "once"},
    Word{TypeNumber::kMotion, field::kMotionMode, Motion::kLoop, "loop"},
    Word{TypeNumber::kMotion, field::kMotionMode, Motion::kPingPong, "ping-pong"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kReport, "report"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kStop, "stop"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kSlide, "slide"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kBounce, "bounce"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kRollback, "rollback"},
    Word{TypeNumber::kInterest, field::kInterestResponse, Interest::kAsk, "ask"},
    Word{TypeNumber::kInterest, field::kInterestMode, Interest::kPseudoDynamic, "pseudo-dynamic"},
    Word{TypeNumber::kInterest, field::kInterestMode, Interest::kStatic, "static"},
    Word{TypeNumber::kInterest, field::kInterestMode, Interest::kDynamic, "dynamic"},
    Word{TypeNumber::kInterest, field::kInterestMode, Interest::kDistance, "distance"},
    Word{TypeNumber::kInterest, field::kInterestMode, Interest::kIgnore, "ignore"},
    Word{TypeNumber::kInterest, field::kInterestDetail, Interest::kYesOrNo, "yes-or-no"},
    Word{TypeNumber::kInterest, field::kInterestDetail, Interest::kAllFaces, "all"},
    Word{TypeNumber::kCollisionObject, field::kCollisionKind, CollisionObject::kStatic, "static"},
    Word{TypeNumber::kCollisionObject, field::kCollisionKind, CollisionObject::kRigid, "rigid"},
    Word{TypeNumber::kCollisionObject, field::kCollisionKind, CollisionObject::kDeforming, "deforming"},
    Word{TypeNumber::kCollisionObject, field::kCollisionDivision, CollisionObject::kWhole, "whole"},
    Word{TypeNumber::kCollisionObject, field::kCollisionDivision, CollisionObject::kEachChild, "each-child"},
    Word{TypeNumber::kCollisionObject, field::kCollisionDivision, CollisionObject::kEachGeometry, "each-geometry"},
    Word{TypeNumber::kCollisionObject, field::kCollisionShape, CollisionObject::kTriangles, "triangles"},
    Word{TypeNumber::kCollisionObject, field::kCollisionShape, CollisionObject::kHull, "hull"},
};

constexpr std::array<std::pair<std::int64_t, std::string_view>, 3> kShow{
    {{Interest::kShowPoints, "points"}, {Interest::kShowNormals, "normals"}, {Interest::kShowFaces, "faces"}}};

}  // namespace

std::optional<std::int64_t> numberOfWord(ObjectType type, FieldId field, std::string_view word) {
    if (type == typeOf<Interest>() && field == field::kInterestShow) return showBits(word);
    for (const Word& known : kWords)
        if (objectType(known.type) == type && known.field == field && known.word == word) return known.number;
    return std::nullopt;
}

std::vector<std::string_view> wordsOf(ObjectType type, FieldId field) {
    if (type == typeOf<Interest>() && field == field::kInterestShow) return {"none", "points", "normals", "faces"};
    std::vector<std::string_view> words;
    for (const Word& known : kWords)
        if (objectType(known.type) == type && known.field == field) words.push_back(known.word);
    return words;
}

std::optional<std::int64_t> showBits(std::string_view words) {
    if (words == "none") return 0;
    std::int64_t bits = 0;
    for (;;) {
        const std::size_t comma = words.find(',');
        const std::string_view word = words.substr(0, comma);
        bool known = false;
        for (const auto& [bit, name] : kShow)
            if (name == word) {
                bits |= bit;
                known = true;
            }
        if (!known) return std::nullopt;
        if (comma == std::string_view::npos) return bits;
        words.remove_prefix(comma + 1);
    }
}

std::string showWords(std::int64_t bits) {
    std::string words;
    for (const auto& [bit, name] : kShow)
        if (bits & bit) words.append(words.empty() ? "" : ",").append(name);
    return words.empty() ? "none" : words;
}

}  // namespace tessera
