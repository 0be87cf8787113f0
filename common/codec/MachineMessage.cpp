#include "common/codec/MachineMessage.h"

namespace tessera {

void put(proto::Wall::Machine& to, const Machine& from) {
    to.set_ssh(from.ssh);
    to.set_port(from.port);
    to.set_command(from.command);
    to.set_display(from.display);
    for (const auto& [name, value] : from.environment) {
        proto::Wall::Variable& variable = *to.add_environment();
        variable.set_name(name);
        variable.set_value(value);
    }
    for (const std::string& argument : from.arguments) to.add_args(argument);
}

Machine machineOf(const proto::Wall::Machine& from) {
    Machine machine{.ssh = from.ssh(), .port = from.port(), .display = from.display()};
    if (!from.command().empty()) machine.command = from.command();
    for (const proto::Wall::Variable& variable : from.environment())
        machine.environment.emplace_back(variable.name(), variable.value());
    machine.arguments.assign(from.args().begin(), from.args().end());
    return machine;
}

}  // namespace tessera
