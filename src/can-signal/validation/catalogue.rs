//! Reasons why a signal has no usable value. The statuses of all flows that receive signals use these texts.

use gateway_base::diagnostics::messages;

messages! {
    /// Why no value of a signal is known.
    MISSING {
        - awaited(message, id, interface, limit) "waiting for the first frame of {message} ({id}) on {interface}, at most {limit} s", "Wait; after that time it is an error. Then check ignition, wiring, bit rate, and whether the profile is this vehicle's.";
        - no_frame_yet(message, id, interface) "no frame of {message} ({id}) on {interface} yet", "Check ignition, wiring, bit rate, and whether the profile is this vehicle's.";
        - no_new_frame_yet(message, id, interface) "no new frame of {message} ({id}) on {interface} yet", "Wait; if it stays, check ignition, wiring, bit rate, and whether the profile is this vehicle's.";
        - too_short(message, id) "{message} ({id}) is received, but too short", "Correct the DBC or the profile; the vehicle's message is shorter.";
        - as_can_fd(message, id) "{message} ({id}) is received, but as CAN FD", "Find out who else sends this identifier, or correct `VFrameFormat` in the DBC.";
        - not_as_can_fd(message, id) "{message} ({id}) is received, but not as CAN FD", "Find out who else sends this identifier, or correct `VFrameFormat` in the DBC.";
        - not_carried(message, id, signal) "{message} ({id}) is received, but without {signal}", "Check whether the vehicle sends the multiplexed page with this signal.";
        - several_senders(message, one, other) "{message} is received from source addresses {one} and {other}: choose one with source_addresses", "Find out which control unit is right (`decode`), and name it in the profile, e.g. `source_addresses = [0x21]`.";
        - stale(message, limit) "{message} is stale, silent for more than {limit} ms", "Check the sending control unit; compare `timeout_ms` with its period.";
        - not_trusted(message, reject) "{message} is not trusted: {reject}", "Read `last_reject`; check the message's integrity keys, and who else sends it.";
        - may_have_changed(message, interface) "{message} may have changed: no frame of the vehicle profile on {interface}", "Read the status of the interface, which names the cause.";
        - bus_off(message, interface) "{message} is not received, {interface} is bus-off", "Read the status of the interface, which names the cause.";
    }
}

messages! {
    /// Why no value of a signal is known on a bus that sleeps as permitted.
    ASLEEP {
        - bus_quiet(message, interface) "no frame of {message}, as nothing on {interface}", "Nothing is to be done; the vehicle is falling asleep. If it should not, read the status of the interface.";
        - bus_asleep(message, interface) "no frame of {message} since bus {interface} fell asleep", "Nothing is to be done; the vehicle is asleep.";
    }
}

messages! {
    /// Why the value of a signal may not be used.
    UNUSABLE {
        - not_available(signal, raw) "{signal} = {raw} means not available", "Wait; if it stays, the control unit does not know its own state.";
        - undefined(signal, raw) "{signal} = {raw} is not a defined value", "Find out what the value means and name it in the profile.";
        - fault(signal, raw) "{signal} = {raw} means fault", "Have the vehicle repaired.";
    }
}

messages! {
    /// Why the vehicle may be another one than the profile's.
    REQUIREMENT {
        - waiting_for(name) "waiting for {name}, which tells this vehicle from others", "Wait; if it stays, the vehicle is another one than the profile's.";
        - observing_absence(time, name) "observing for {time} ms that no {name} comes, which tells this vehicle from others", "Wait until the time has passed.";
        - other_message(name, vehicle) "the profile is for another vehicle: {name} is received, which belongs to {vehicle}", "Use the profile of this vehicle, and restart.";
        - other_value(signal, raw, vehicle) "the profile is for another vehicle: {signal} = {raw}, which belongs to {vehicle}", "Use the profile of this vehicle, and restart.";
    }
}
