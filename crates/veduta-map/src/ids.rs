/// Declares indices into the tables of a map or a scene, one type for each table.
macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The index into the table.
            #[inline(always)]
            pub const fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of row `index`.
            ///
            /// # Panics
            /// If the table has more than `u32::MAX` rows.
            #[inline(always)]
            pub fn from_index(index: usize) -> Self {
                Self(u32::try_from(index).expect("a table holds at most u32::MAX rows"))
            }
        }
    )*};
}

ids! {
    /// A row of [`crate::Faces`]. Ids ascend in key order (layer priority, object path, face): of
    /// coplanar faces the smaller id is seen.
    FaceId;
    /// A supporting plane. Coplanar faces share one.
    PlaneId;
    /// A line of the image plane.
    LineId;
    /// An object of the scene.
    ObjectId;
    /// A material.
    MaterialId;
}
