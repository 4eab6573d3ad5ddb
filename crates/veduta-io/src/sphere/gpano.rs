//! GPano: how photographs tell that they are panoramas, in XMP.
//!
//! A packet of XMP is RDF in XML; the properties of the namespace [`NAMESPACE`] stand in it as attributes
//! or as elements. Of them we use those that tell where the picture lies on the sphere.

use veduta::reproject::Orientation;

/// The namespace of the properties.
const NAMESPACE: &str = "http://ns.google.com/photos/1.0/panorama/";

/// How a camera stood, in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Where the middle of the picture lies: clockwise from north.
    pub heading: f64,
    /// How far that is above the horizon.
    pub pitch: f64,
    /// How far the camera leaned to the right.
    pub roll: f64,
}

/// What a picture tells of itself as a panorama, all of it in equirectangular projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gpano {
    /// Width and height of the whole sphere, in pixels.
    pub full: [u32; 2],
    /// Where the picture's left top corner lies in it.
    pub left_top: [u32; 2],
    /// Width and height of the picture when that was said; it may have been scaled since.
    pub cropped: [u32; 2],
    /// How the camera stood.
    pub pose: Pose,
}

impl Gpano {
    /// Of a whole sphere in a picture of that size, not turned.
    pub fn whole(width: u32, height: u32) -> Self {
        Self {
            full: [width, height],
            left_top: [0, 0],
            cropped: [width, height],
            pose: Pose::default(),
        }
    }

    /// From a packet of XMP. `None` if it tells nothing of a panorama.
    ///
    /// # Errors
    /// A sentence, when it tells of one that is not equirectangular or makes no sense.
    pub fn read(packet: &[u8]) -> Result<Option<Self>, String> {
        // Packets may be padded by zeros.
        let text = String::from_utf8_lossy(packet);
        let text = text.trim_matches(['\0', '\u{feff}']).trim();
        let document = roxmltree::Document::parse(text)
            .map_err(|error| format!("its XMP cannot be read: {error}"))?;
        let property = |name: &str| {
            document.descendants().find_map(|node| {
                if node.is_element() && node.tag_name().namespace() == Some(NAMESPACE) {
                    let is_it = node.tag_name().name() == name;
                    return is_it.then(|| node.text().unwrap_or("").trim());
                }
                let mut attributes = node.attributes();
                let found = attributes.find(|attribute| {
                    attribute.namespace() == Some(NAMESPACE) && attribute.name() == name
                });
                found.map(|attribute| attribute.value().trim())
            })
        };
        let number = |name: &str| match property(name) {
            None => Ok(None),
            Some(text) => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(format!(
                    "its XMP tells a {name} of {text:?}, which is no number"
                )),
            },
        };
        match property("ProjectionType") {
            None if property("FullPanoWidthPixels").is_none() => return Ok(None),
            None | Some("equirectangular") => {}
            Some(other) => {
                return Err(format!(
                    "its XMP tells of a panorama in the projection {other:?}, and only equirectangular is \
                     known there"
                ));
            }
        }
        let pixels = |name: &str| match number(name)? {
            Some(count) if (0.0..=1e9).contains(&count) => Ok(Some(count.round() as u32)),
            Some(count) => Err(format!("its XMP tells a {name} of {count}")),
            None => Ok(None),
        };
        let full = [
            pixels("FullPanoWidthPixels")?,
            pixels("FullPanoHeightPixels")?,
        ];
        let cropped = [
            pixels("CroppedAreaImageWidthPixels")?,
            pixels("CroppedAreaImageHeightPixels")?,
        ];
        let left_top = [
            pixels("CroppedAreaLeftPixels")?,
            pixels("CroppedAreaTopPixels")?,
        ];
        let angle = |name: &str| Ok::<_, String>(number(name)?.unwrap_or(0.0).to_radians());
        let pose = Pose {
            heading: angle("PoseHeadingDegrees")?,
            pitch: angle("PosePitchDegrees")?,
            roll: angle("PoseRollDegrees")?,
        };
        let mut found = Self {
            full: [0; 2],
            left_top: [0; 2],
            cropped: [0; 2],
            pose,
        };
        for axis in [0, 1] {
            // What is not told is whole.
            let size = full[axis].or(cropped[axis]).unwrap_or(0);
            found.full[axis] = size;
            found.cropped[axis] = cropped[axis].unwrap_or(size);
            found.left_top[axis] = left_top[axis].unwrap_or(0);
            let end = u64::from(found.left_top[axis]) + u64::from(found.cropped[axis]);
            let is_told = full[axis].is_some() || cropped[axis].is_some();
            if is_told && (found.cropped[axis] == 0 || end > u64::from(size)) {
                return Err(format!(
                    "its XMP tells of a part from {} to {end} of a panorama of {size} pixels",
                    found.left_top[axis]
                ));
            }
        }
        Ok(Some(found))
    }

    /// The part of the sphere that the picture covers: from left to right and from top to bottom, as
    /// shares of the whole.
    pub fn part(&self) -> [[f64; 2]; 2] {
        let share = |axis: usize| {
            let full = f64::from(self.full[axis]);
            let start = f64::from(self.left_top[axis]);
            match self.full[axis] {
                0 => [0.0, 1.0],
                _ => [start / full, (start + f64::from(self.cropped[axis])) / full],
            }
        };
        [share(0), share(1)]
    }

    /// The orientation that makes the horizon level; the middle of the picture stays in front.
    pub fn level(&self) -> Orientation {
        Orientation::from_angles(0.0, self.pose.pitch, self.pose.roll)
    }

    /// A packet of XMP that tells it.
    pub fn packet(&self) -> String {
        let [full_width, full_height] = self.full;
        let [width, height] = self.cropped;
        let [left, top] = self.left_top;
        let mut attributes = format!(
            "GPano:UsePanoramaViewer=\"True\" GPano:ProjectionType=\"equirectangular\" \
             GPano:FullPanoWidthPixels=\"{full_width}\" GPano:FullPanoHeightPixels=\"{full_height}\" \
             GPano:CroppedAreaImageWidthPixels=\"{width}\" \
             GPano:CroppedAreaImageHeightPixels=\"{height}\" \
             GPano:CroppedAreaLeftPixels=\"{left}\" GPano:CroppedAreaTopPixels=\"{top}\""
        );
        for (name, angle) in [
            ("PoseHeadingDegrees", self.pose.heading),
            ("PosePitchDegrees", self.pose.pitch),
            ("PoseRollDegrees", self.pose.roll),
        ] {
            if angle != 0.0 {
                attributes += &format!(" GPano:{name}=\"{}\"", angle.to_degrees());
            }
        }
        format!(
            "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\
             <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\
             <rdf:Description rdf:about=\"\" xmlns:GPano=\"{NAMESPACE}\" {attributes}/>\
             </rdf:RDF></x:xmpmeta>"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let pose = Pose {
            heading: 1.25,
            pitch: -0.5,
            roll: 0.0,
        };
        for told in [
            Gpano::whole(4096, 2048),
            Gpano {
                full: [4000, 2000],
                left_top: [100, 700],
                cropped: [2500, 600],
                pose,
            },
        ] {
            let read = Gpano::read(told.packet().as_bytes()).expect("is sound");
            let read = read.expect("is of a panorama");
            assert_eq!((read.full, read.left_top), (told.full, told.left_top));
            assert_eq!(read.cropped, told.cropped);
            assert!((read.pose.heading - told.pose.heading).abs() < 1e-12);
        }
    }

    #[test]
    fn elements_are_read_like_attributes_and_other_packets_tell_nothing() {
        let packet = |inside: &str| {
            format!(
                "<?xpacket begin='' id='x'?><x:xmpmeta xmlns:x='adobe:ns:meta/'>\
                 <r:RDF xmlns:r='http://www.w3.org/1999/02/22-rdf-syntax-ns#'>\
                 <r:Description xmlns:g='{NAMESPACE}'>{inside}</r:Description></r:RDF></x:xmpmeta>"
            )
        };
        let read = |inside: &str| Gpano::read(packet(inside).as_bytes());
        assert_eq!(read(""), Ok(None));
        let full = "<g:FullPanoWidthPixels>800</g:FullPanoWidthPixels>\
             <g:FullPanoHeightPixels> 400 </g:FullPanoHeightPixels>";
        let crop = "<g:CroppedAreaTopPixels>100</g:CroppedAreaTopPixels>\
             <g:CroppedAreaImageHeightPixels>200</g:CroppedAreaImageHeightPixels>";
        let found = read(&format!("{full}{crop}"))
            .expect("is sound")
            .expect("is one");
        assert_eq!(found.part(), [[0.0, 1.0], [0.25, 0.75]]);
        for (inside, told) in [
            (
                "<g:ProjectionType>cylindrical</g:ProjectionType>".to_owned(),
                "cylindrical",
            ),
            (
                format!("{full}<g:CroppedAreaLeftPixels>9</g:CroppedAreaLeftPixels>"),
                "809",
            ),
            (
                "<g:FullPanoWidthPixels>many</g:FullPanoWidthPixels>".to_owned(),
                "many",
            ),
            (
                "<g:FullPanoWidthPixels>-5</g:FullPanoWidthPixels>".to_owned(),
                "-5",
            ),
        ] {
            let error = read(&inside).expect_err(told);
            assert!(error.contains(told), "{error}");
        }
        assert!(Gpano::read(b"<x:xmpmeta").is_err());
    }
}
