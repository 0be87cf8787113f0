/// What the wall shows, and from where: `view`, `navigate`, `show`, `budget`, `exposure`,
/// `pick`.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// A wish that wants nothing asks where all is.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::View& view);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Show& show);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Budget& budget);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Exposure& exposure);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Navigate& navigate);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Pick& pick);

/// What a frame may take, and what that costs of the scene's detail.
[[nodiscard]] std::string budgetText(const answer::Status& status);

}  // namespace tessera
