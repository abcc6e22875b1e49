//! Starts the plugin as the main program of `zenoh-bridge-ros2dds` does, with the one option that the tests
//! need.
//!
//! Usage: zenoh-bridge-ros2dds -c CONFIGURATION

use std::error::Error;

use zenoh::config::Config;
use zenoh::internal::plugins::PluginsManager;
use zenoh::internal::runtime::RuntimeBuilder;
use zenoh_plugin_ros2dds::ROS2Plugin;

/// What the bridge sets whatever its configuration contains.
const SETTINGS: [&str; 3] = ["timestamping/enabled", "adminspace/enabled", "plugins_loading/enabled"];

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    zenoh::init_log_from_env_or("z=info");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [option, file] = &arguments[..] else {
        return Err("usage: zenoh-bridge-ros2dds -c CONFIGURATION".into());
    };
    if option != "-c" {
        return Err(format!("{option}: unknown option, only -c is known").into());
    }
    let mut config = Config::from_file(file)?;
    for key in SETTINGS {
        config.insert_json5(key, "true")?;
    }
    let mut plugins = PluginsManager::static_plugins_only();
    plugins.declare_static_plugin::<ROS2Plugin, &str>("ros2dds", true);
    let mut runtime = RuntimeBuilder::new(config).plugins_manager(plugins).build().await?;
    runtime.start().await?;
    std::future::pending().await
}
