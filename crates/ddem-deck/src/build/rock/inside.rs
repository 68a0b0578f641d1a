//! Surfaces of tunnels, for each `where` that selects the inside of one by its name.

use std::borrow::Cow;
use std::sync::Arc;

use ddem_cut::{Compass, Outline, Tunnel};

use crate::schema::{Deck, Triangles, TunnelCut};

impl Deck {
    /// Tunnel of the cut with a name.
    pub(crate) fn tunnel(&self, name: &str) -> Option<&TunnelCut> {
        let named = |cut: &&crate::schema::RockCut| cut.name.as_deref() == Some(name);
        self.cut.iter().find(named)?.tunnel.as_ref()
    }

    /// Names of the tunnels.
    pub(crate) fn tunnel_names(&self) -> impl Iterator<Item = &str> + Clone {
        let tunnels = self.cut.iter().filter(|cut| cut.tunnel.is_some());
        tunnels.filter_map(|cut| cut.name.as_deref())
    }

    /// Gives each `where` that names a tunnel the surface of that tunnel. Tunnels with faults have none.
    pub(crate) fn fill_tunnels(&mut self) {
        let names: Vec<String> = self.tunnel_names().map(str::to_owned).collect();
        let surfaces = names.into_iter().map(|name| {
            let surface = self.tunnel(&name).and_then(|tunnel| self.surface(tunnel));
            (name, surface.map(Arc::new))
        });
        let surfaces: Vec<(String, Option<Arc<Triangles>>)> = surfaces.collect();
        for (_, selector) in self.selectors_mut() {
            let Some(file) = &mut selector.inside else { continue };
            if let Some((_, surface)) = surfaces.iter().find(|(name, _)| *name == file.path) {
                file.content.clone_from(surface);
            }
        }
    }

    /// Same deck, with the surfaces of the tunnels that it names.
    pub(crate) fn with_tunnels(&self) -> Cow<'_, Self> {
        let unfilled = |file: &crate::schema::FileOf<Triangles>| {
            file.content.is_none() && self.tunnel(&file.path).is_some()
        };
        let any = self.selectors().iter().any(|(_, of)| of.inside.as_ref().is_some_and(unfilled));
        if !any {
            return Cow::Borrowed(self);
        }
        let mut filled = self.clone();
        filled.fill_tunnels();
        Cow::Owned(filled)
    }

    /// Surface of a tunnel. A shaft is turned to the north of the first region, which all have.
    fn surface(&self, tunnel: &TunnelCut) -> Option<Triangles> {
        let north = self.region.first().map_or([0.0, 1.0, 0.0], |region| region.north);
        let outline = Outline::new(&tunnel.outline).ok()?;
        let ends = [tunnel.from, tunnel.to].map(Into::into);
        let compass = Compass::new(north.into())?;
        let tunnel = Tunnel::new(&outline, ends, &compass, 0, true).ok()?;
        let corners = |triangle: [ddem_core::problem::Vec3; 3]| triangle.map(Into::into);
        Some(Triangles(tunnel.triangles().into_iter().map(corners).collect()))
    }
}
