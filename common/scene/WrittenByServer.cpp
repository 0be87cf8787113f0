#include "common/scene/WrittenByServer.h"

#include <algorithm>
#include <array>

#include "common/cores/Inline.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Movie.h"
#include "common/cores/Node.h"
#include "common/cores/ProxyGroup.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {
namespace {

constexpr std::string_view kProgram = "change the program's text", kFilm = "name another file",
                           kHeld = "grab the handle", kPixels = "set its pixels", kWanted = "set its wanted";

constexpr std::array kFields = {
    FieldOfServer{typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>, kProgram},
    FieldOfServer{typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::problem>, kProgram},
    FieldOfServer{typeOf<Movie>(), fieldId<&Movie::problem>, kFilm},
    FieldOfServer{typeOf<Manipulator>(), fieldId<&Manipulator::held>, kHeld},
    FieldOfServer{typeOf<Manipulator>(), fieldId<&Manipulator::sizes>, kPixels},
    FieldOfServer{typeOf<Manipulator>(), fieldId<&Manipulator::moreSizes>, kPixels},
    FieldOfServer{typeOf<Inline>(), fieldId<&Inline::state>, kWanted},
    FieldOfServer{typeOf<Inline>(), fieldId<&Inline::problem>, kWanted},
    FieldOfServer{typeOf<ProxyGroup>(), fieldId<&ProxyGroup::state>, kWanted},
    FieldOfServer{typeOf<ProxyGroup>(), fieldId<&ProxyGroup::problem>, kWanted},
    FieldOfServer{typeOf<Node>(), fieldId<&Node::levels>, "", true},
    FieldOfServer{typeOf<Node>(), fieldId<&Node::ofServer>, ""},
};

}  // namespace

const FieldOfServer* fieldOfServer(ObjectType type, FieldId field) {
    const auto known = std::ranges::find_if(
        kFields, [&](const FieldOfServer& each) { return each.type == type && each.field == field; });
    return known == kFields.end() ? nullptr : &*known;
}

}  // namespace tessera
