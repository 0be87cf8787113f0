#include "server/rules/MaterialCheck.h"

#include <algorithm>
#include <array>
#include <variant>

#include <fmt/format.h>

#include "common/cores/Material.h"

namespace tessera {
namespace {

struct MostRefs {
    FieldId field;
    const char* what;
    std::size_t most;
};
constexpr std::array kMostRefs = {MostRefs{fieldId<&Material::passes>, "passes", Material::kMostPasses},
                                  MostRefs{fieldId<&Material::uniforms>, "uniforms", Material::kMostUniforms}};

}  // namespace

Sound checkMaterials(const ChangeList& list) {
    for (const FieldColumn& column : list.columns) {
        if (const auto* refs = std::get_if<std::vector<RefList>>(&column.values);
            refs && column.type == typeOf<Material>())
            for (const MostRefs& bound : kMostRefs)
                for (std::size_t row = 0;
                     column.field == bound.field && row < std::min(refs->size(), column.ids.size()); ++row) {
                    if ((*refs)[row].size() > bound.most)
                        return tl::unexpected(
                            Fault{column.ids[row],
                                  typeOf<Material>(),
                                  {ErrorCode::kLimit,
                                   fmt::format("{} {}, and {} may be", (*refs)[row].size(), bound.what, bound.most)}});
                    // It would be drawn over itself, and look as it does: nothing but time.
                    if (column.field == fieldId<&Material::passes> &&
                        std::ranges::find((*refs)[row], column.ids[row]) != (*refs)[row].end())
                        return tl::unexpected(
                            Fault{column.ids[row],
                                  typeOf<Material>(),
                                  {ErrorCode::kBadInput, "it is among its own passes; a pass is another material"}});
                }
    }
    return {};
}

}  // namespace tessera
