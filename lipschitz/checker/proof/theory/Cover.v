(** A bound on every part of a box is a bound on the box. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges Relaxation Increments Signs.
Import ListNotations.
Open Scope R_scope.

Lemma length_way s x y : length x = length y -> length (on_the_way s x y) = length y.
Proof.
  unfold on_the_way. revert y. induction x as [|a x IH]; intros [|b y]; simpl; try discriminate; auto.
Qed.
Lemma way_within b x y s : 0 <= s <= 1 -> within b x -> within b y -> within b (on_the_way s x y).
Proof.
  intros Hs. unfold on_the_way. revert x y. induction b as [|[l h] b IH]; intros [|a x] [|c y]; simpl; try tauto.
  intros [H1 H2] [G1 G2]. split; [nra|auto].
Qed.
Lemma way_agrees moves x y s : agree moves x y -> agree moves x (on_the_way s x y) /\ agree moves (on_the_way s x y) y.
Proof.
  unfold on_the_way. revert x y. induction moves as [|m moves IH]; intros [|a x] [|c y]; simpl; try tauto.
  intros [H G]. destruct (IH _ _ G). destruct H as [-> | ->]; repeat split; auto; right; ring.
Qed.
Lemma nth_on_the_way k s x y : nth k (on_the_way s x y) 0 = (1 - s) * nth k x 0 + s * nth k y 0.
Proof. unfold on_the_way. now rewrite nth_plus, !nth_scaled. Qed.
Lemma scale_one x : scaleR (/ 1) x = x.
Proof. unfold scale. rewrite <- (map_id x) at 2. apply map_ext. intros a. field. Qed.
Lemma square_in_way scale x y s : length x = length y ->
  square_in scale (minus x (on_the_way s x y)) = s * s * square_in scale (minus x y) /\
  square_in scale (minus (on_the_way s x y) y) = (1 - s) * (1 - s) * square_in scale (minus x y).
Proof.
  unfold on_the_way, minus. revert scale y.
  induction x as [|a x IH]; intros scale [|b y]; simpl; try discriminate; intros H;
    [split; ring|].
  destruct (IH (tl scale) y ltac:(lia)) as [-> ->]. unfold Rdiv. split; ring.
Qed.
Lemma sqrt_of_square a q : 0 <= a -> sqrt (a * a * q) = a * sqrt q.
Proof. intros H. rewrite sqrt_mult_alt by nra. now rewrite sqrt_square. Qed.
Lemma distance_way scale x y s : 0 <= s <= 1 -> length x = length y ->
  distance scale x (on_the_way s x y) = s * distance scale x y /\
  distance scale (on_the_way s x y) y = (1 - s) * distance scale x y.
Proof.
  intros Hs L. unfold distance. destruct (square_in_way scale x y s L) as [-> ->].
  split; apply sqrt_of_square; lra.
Qed.
Lemma within_cut b k m (is_upper : bool) x : within b x ->
  (if is_upper then real m <= nth k x 0 else nth k x 0 <= real m) ->
  within (cut k m is_upper b) x.
Proof.
  revert k x. induction b as [|[l h] b IH]; intros [|k] [|a x]; simpl; try tauto; intros [H1 H2] C.
  - destruct is_upper; simpl; (split; [lra|auto]).
  - split; auto.
Qed.

(** A conflict that is shown holds all over the box. *)
Lemma lines_before_hold ls lines before k h x : Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  lines_hold ls lines h -> h = reach before x -> valid before x -> (k < length lines)%nat ->
  valid (lines_before ls lines before k) x /\
  layer_values ls k h = affine (realm (fst (nth k ls no_layer))) (reals (snd (nth k ls no_layer)))
    (reach (lines_before ls lines before k) x) /\
  length (snd (nth k ls no_layer)) = length (fst (nth k ls no_layer)).
Proof.
  intros F. revert lines before k h. induction F as [|[w c] ls Hc F IH]; intros [|l lines] before [|k] h; simpl;
    try tauto; try lia.
  - intros [H G] -> V _. auto.
  - intros [H G] -> V L. apply (IH lines ((w, c, l) :: before) k _ G); simpl; auto. lia.
Qed.
Lemma place_holds ls lines p h : Forall (fun l : layerD => length (snd l) = length (fst l)) ls ->
  lines_hold ls lines h ->
  place_is_open lines p = true -> let (d, j) := form_of_place ls lines p in
  sign_of p * value_at ls (in_layer p) (in_row p) h <= dotR (reals d) h + real j.
Proof.
  intros F H. unfold place_is_open, form_of_place, value_at. destruct (nth_error _ _) as [l|] eqn:E; [|discriminate].
  intros _.
  assert (in_row p < length (nth (in_layer p) lines []))%nat as Lr by (apply nth_error_Some; congruence).
  assert (in_layer p < length lines)%nat as Ll.
  { destruct (lt_dec (in_layer p) (length lines)); auto. rewrite nth_overflow in Lr by lia. simpl in Lr. lia. }
  destruct (lines_before_hold ls lines [] (in_layer p) h h F H eq_refl I Ll) as (V & Y & Lc).
  assert (length (nth (in_layer p) lines []) = length (layer_values ls (in_layer p) h)) as Ly.
  { clear - H F Ll. revert lines h H Ll. generalize (in_layer p). intros k. revert k.
    induction F as [|[w c] ls Hc F IH]; intros k [|l lines] h; simpl; try tauto; try lia. intros [H G] L.
    destruct k as [|k]; simpl; [now apply Forall2_lengths in H|]. apply IH; auto. lia. }
  rewrite Y, length_affine in Ly by (now rewrite !map_length). rewrite map_length in Ly. rewrite Y.
  destruct (nth (in_layer p) ls no_layer) as [w c]. simpl in *.
  rewrite nth_affine by lia.
  set (s := if stays_on p then one else (-1, 0)%Z).
  pose proof (form_above_holds (lines_before ls lines [] (in_layer p)) [] (scale mul s (nth (in_row p) w []))
    (mul s (nth (in_row p) c zero)) h V) as M.
  destruct (form_above _ _ _ _) as [d j]. rewrite (f_scale mul Rmult real real_mul), dot_scale_l, real_mul in M.
  assert (real s = sign_of p) as S.
  { unfold s, sign_of. destruct (stays_on p); [apply real_one|apply real_minus_one]. }
  rewrite S in M. lra.
Qed.
Lemma shown_excluded ls lines b c x : Forall (fun l : layerD => length (snd l) = length (fst l)) ls -> within b x ->
  lines_hold ls lines x -> is_shown ls lines b c = true -> excluded ls c x.
Proof.
  intros F W H. unfold is_shown. pose proof (place_holds ls lines (first c) x F H) as P1.
  pose proof (place_holds ls lines (second c) x F H) as P2.
  destruct (form_of_place ls lines (first c)) as [f k]. destruct (form_of_place ls lines (second c)) as [g j].
  intros S. do 5 both S. specialize (P1 S). specialize (P2 H4). apply real_nonnegative in H2, H3.
  apply real_positive in H1.
  rewrite real_add in H1. apply nonpositive in H0. rewrite !real_add, !real_mul in H0.
  pose proof (row_ends_within (plus add (scale mul (weight c) f) (scale mul (rest c) g)) b x W) as [_ E].
  rewrite (f_plus add Rplus real real_add), !(f_scale mul Rmult real real_mul), dot_plus_l, !dot_scale_l in E.
  unfold excluded. repeat split; auto.
  pose proof (Rmult_le_compat_l _ _ _ H3 P1). pose proof (Rmult_le_compat_l _ _ _ H2 P2). lra.
Qed.

(** A tree of parts holds of usable points z that are looked at as z / size z, in a box. *)
Section Cover.
Context (o : hints) (ls : list layerD) (inequality : list (list line) -> list conflict -> list dyadic ->
  matrixD) (moves : list bool)
  (scale : list dyadic) (u : R) (f : list R -> list R) (n : nat) (usable : list R -> Prop) (size : list R -> R).
Context (fits : Forall (fun l : layerD => length (snd l) = length (fst l)) ls) (values : forall x, length (f x) = n).
Definition bounded_between x y := norm (minus (f x) (f y)) <= u * distance scale x y.
Definition looked_at x := scaleR (/ size x) x.
Context (sizes : forall s x y, size (on_the_way s x y) = (1 - s) * size x + s * size y).
Context (positive_size : forall x, usable x -> 0 < size x).
Context (excluded_at : forall c x, usable x -> excluded ls c (looked_at x) -> excluded ls c x).
Context (in_part : forall lines cs ts x y,
  forallb is_nonnegative ts = true -> nonnegative (realm (inequality lines cs ts)) ->
  usable x -> usable y -> lines_hold ls lines (looked_at x) -> lines_hold ls lines (looked_at y) ->
  agree moves x y -> same_signs ls x y -> Forall (fun c => excluded ls c x /\ excluded ls c y) cs ->
    bounded_between x y).
Lemma between_halves x y s : 0 <= s <= 1 -> length x = length y ->
  bounded_between x (on_the_way s x y) -> bounded_between (on_the_way s x y) y -> bounded_between x y.
Proof.
  intros Hs L. unfold bounded_between. destruct (distance_way scale x y s Hs L) as [-> ->]. intros H G.
  rewrite (minus_through _ (f (on_the_way s x y))) by now rewrite !values.
  eapply Rle_trans; [apply norm_plus|]. lra.
Qed.
(** Which side of a cut z / size z is on. *)
Definition side (k : nat) (m : dyadic) (x : list R) : R := nth k x 0 - real m * size x.
Lemma side_way k m s x y : side k m (on_the_way s x y) = (1 - s) * side k m x + s * side k m y.
Proof. unfold side. rewrite sizes, nth_on_the_way. ring. Qed.
Lemma below_cut k m x : 0 < size x -> side k m x <= 0 -> nth k (looked_at x) 0 <= real m.
Proof.
  unfold side, looked_at. intros P H. rewrite nth_scaled. apply (Rmult_le_reg_l (size x)); auto.
  rewrite <- Rmult_assoc, Rinv_r by lra. lra.
Qed.
Lemma above_cut k m x : 0 < size x -> 0 <= side k m x -> real m <= nth k (looked_at x) 0.
Proof.
  unfold side, looked_at. intros P H. rewrite nth_scaled. apply (Rmult_le_reg_l (size x)); auto.
  rewrite <- Rmult_assoc, Rinv_r by lra. lra.
Qed.
(** Of any convex set in the box. *)
Lemma tree_covers t (D : list R -> Prop) b around : check_tree o ls inequality b around t = true ->
  (forall x y s, 0 <= s <= 1 -> D x -> D y -> D (on_the_way s x y)) -> (forall x, D x -> usable x) ->
  (forall x, D x -> within b (looked_at x)) -> (forall x, D x -> known ls around (looked_at x)) ->
  forall x y, agree moves x y -> D x -> D y -> bounded_between x y.
Proof.
  revert D b around. induction t as [ds cs ts|ds k m lower IHl upper IHu]; intros D b around; cbn [check_tree];
    intros H C P W K x y A Dx Dy; (destruct (bounds o b [] ls around ds) as [lines|] eqn:B; [|discriminate]);
    pose proof (fun z Dz => bounds_hold o b _ (W z Dz) ls around ds lines fits (K z Dz) B) as Z; both H.
  - apply shown_sound in H0. revert x y Dx Dy A. apply (all_neurons ls fits bounded_between D moves C).
    + intros x y s A. now apply way_agrees.
    + intros x y s Hs A. apply between_halves; auto. destruct (agree_lengths _ _ _ A). congruence.
    + intros x y Dx Dy A Same. eapply in_part; eauto. apply Forall_forall. intros c Hc. apply filter_In in Hc.
      destruct Hc as [_ Hc]. split; apply excluded_at; auto; eapply shown_excluded; eauto.
  - assert (forall z w, agree moves z w -> D z -> D w -> side k m z <= 0 -> side k m w <= 0 ->
      bounded_between z w) as Below.
    { intros z w Azw Dz Dw Hz Hw. apply (IHl (fun v => D v /\ side k m v <= 0) _ _ H); auto.
      - intros v v' s Hs [G1 G2] [G3 G4]. split; auto. rewrite side_way. nra.
      - intros v [G1 _]. auto.
      - intros v [G1 G2]. apply within_cut; auto. now apply below_cut; auto.
      - intros v [G1 _]. apply known_of; auto. }
    assert (forall z w, agree moves z w -> D z -> D w -> 0 <= side k m z -> 0 <= side k m w ->
      bounded_between z w) as Above.
    { intros z w Azw Dz Dw Hz Hw. apply (IHu (fun v => D v /\ 0 <= side k m v) _ _ H0); auto.
      - intros v v' s Hs [G1 G2] [G3 G4]. split; auto. rewrite side_way. nra.
      - intros v [G1 _]. auto.
      - intros v [G1 G2]. apply within_cut; auto. now apply above_cut; auto.
      - intros v [G1 _]. apply known_of; auto. }
    assert (length x = length y) as L by (destruct (agree_lengths _ _ _ A); congruence).
    set (a := side k m x) in *. set (c := side k m y) in *.
    destruct (Rle_dec a 0) as [Lx|Lx], (Rle_dec c 0) as [Ly|Ly]; [now apply Below| | |apply Above; auto; fold a c; lra].
    all: set (s := a / (a - c)); assert (s * (a - c) = a) as E by (unfold s; field; lra);
      assert (0 <= s <= 1) as Hs by (split; nra); destruct (way_agrees moves x y s A) as [A1 A2];
      assert (side k m (on_the_way s x y) = 0) as M by (rewrite side_way; fold a c; lra);
      apply (between_halves x y s Hs L).
    + apply Below; auto. lra.
    + apply Above; auto; fold c; lra.
    + apply Above; auto; fold a; lra.
    + apply Below; auto; lra.
Qed.
End Cover.

Lemma square_root_bound d r u q : 0 <= u -> r <= u * u -> 0 <= q -> square d <= r * q -> norm d <= u * sqrt q.
Proof.
  intros Hu Hr Hq H. unfold norm. rewrite <- (sqrt_square u) by auto. rewrite <- sqrt_mult_alt by nra.
  apply sqrt_le_1_alt. eapply Rle_trans; [exact H|]. now apply Rmult_le_compat_r.
Qed.
(** What `covers` has to show: of points in a set,
  and functions G of the part's values whose increments these measure. *)
Lemma parts_sound ps f moves scale u r form covers (inside : list R -> Prop) : let p := part_at ps (moved f) in
  check_parts_with ps f moves scale u r form covers = true ->
  (forall q, covers q = true -> Forall (fun l : layerD => length (snd l) = length (fst l)) (hidden p) ->
    length (snd (outer p)) = length (fst (outer p)) -> positive_scale scale = true -> length moves = inputs_of p ->
    0 <= real u -> real r <= real u * real u ->
    let g := network (relu_layers (hidden p)) (real_layer (outer p)) in
    forall (G : list R -> list R) n, (forall z, length (G z) = n) ->
    (forall z w, square (minus (G z) (G w)) <= measured q (minus (g z) (g w))) ->
    forall x y, agree moves x y -> inside x -> inside y -> norm (minus (G x) (G y)) <= real u * distance scale x y) ->
  forall rest x y, agree moves x y -> inside (clamped (clamp p) x) -> inside (clamped (clamp p) y) ->
  norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y.
Proof.
  cbv zeta. unfold check_parts_with, well_formed. intros H I rest x y A Ix Iy. do 4 both H. do 4 both H.
  rename H0 into HC, H1 into Hr, H2 into Hu, H3 into HR, H4 into Hl, H5 into Hs, H6 into Hm, H7 into Hc.
  apply at_most_real in Hr. rewrite real_mul in Hr. apply real_nonnegative in Hu. apply Nat.eqb_eq in Hm.
  set (p := part_at ps (moved f)) in *. set (c := clamp p) in *.
  assert (fits_part p = true /\ relu_between p = true) as [Fp Rp].
  { unfold p. destruct f; simpl in *; both H; both HR; auto. }
  assert (Forall (fun l : layerD => length (snd l) = length (fst l)) (hidden p)) as Fh.
  { apply Forall_forall. intros l G. apply (fits_layer p); auto. apply in_or_app. now left. }
  assert (length (snd (outer p)) = length (fst (outer p))) as Fo
    by (apply (fits_layer p); auto; apply in_or_app; right; now left).
  assert (forall z, value p z = network (relu_layers (hidden p)) (real_layer (outer p)) (clamped c z)) as V.
  { intros z. unfold value. now rewrite relu_network. }
  set (g z := network (relu_layers (hidden p)) (real_layer (outer p)) z) in *.
  assert (forall q, covers q = true -> forall (G : list R -> list R) n, (forall z, length (G z) = n) ->
    (forall z w, square (minus (G z) (G w)) <= measured q (minus (g z) (g w))) ->
    norm (minus (G (clamped c x)) (G (clamped c y))) <= real u * distance scale x y) as T.
  { intros q T G n LG MG. pose proof (agree_clamped c _ _ _ A) as A'.
    apply Rle_trans with (real u * distance scale (clamped c x) (clamped c y)); [apply (I q T Fh Fo Hs Hm Hu Hr G n);
      auto|].
    apply Rmult_le_compat_l; auto. apply sqrt_le_1_alt, square_in_clamped. destruct (agree_lengths _ _ _ A).
    congruence. }
  assert (forall z, length (g z) = length (fst (outer p))) as Lg.
  { intros z. unfold g. rewrite network_end, length_affine; simpl; now rewrite ?map_length. }
  destruct f as [k|phi rho], form as [q|]; simpl in HC; try discriminate.
  - simpl value_of. change (part_at ps k) with p. rewrite !V. fold c. apply (T None HC g _ Lg). intros z w.
    apply Rle_refl.
  - apply andb_prop in HC. destruct HC as [HC HT]. apply andb_prop in HC. destruct HC as [HC HF].
    apply Nat.eqb_eq in HC.
    simpl value_of. change (part_at ps phi) with p. rewrite !V. fold c.
    assert (fits_part (part_at ps rho) = true /\ relu_between (part_at ps rho) = true /\ clamp (part_at ps rho) =
      []) as (Fr & Rr & Cr).
    { simpl in H, HR, Hc. destruct (clamp (part_at ps rho)); [|rewrite ?andb_false_r in Hc; discriminate].
      rewrite !andb_true_r in *. apply andb_prop in H, HR. tauto. }
    unfold check_form in HF. apply andb_prop in HF. destruct HF as [HP HF]. apply shown_sound in HF.
    apply (T _ HT (fun z => value (part_at ps rho) (plusR (g z) rest)) (length (fst (outer (part_at ps rho)))));
      [intros z; now apply length_value|].
    intros z w. simpl measured. apply form_holds with (ts := form_multipliers q); auto; rewrite Lg; exact HC.
Qed.
Lemma slope_in_box_sound ps f moves scale b u r form o t :
  check_parts_of_box ps f moves scale b u r form o t = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  intros H rest x y A Lx Wx Wy. set (p := part_at ps (moved f)) in *.
  apply (parts_sound ps f moves scale u r form _ (within (clamp_ends (clamp p) b)) H); auto using within_clamped.
  clear - p. cbv beta. fold p. intros q T Fh Fo Hs _ Hu Hr g G n LG MG x y A Ix Iy.
  assert (forall z, looked_at (fun _ => 1) z = z) as Id by (intros z; apply scale_one).
  apply (tree_covers o (hidden p) (part_inequality (hidden p) (outer p) q moves scale r) moves scale (real u) G n (fun
    _ => True) (fun _ => 1))
    with (t := t) (D := within (clamp_ends (clamp p) b)) (b := clamp_ends (clamp p) b) (around := []); auto.
  - intros. ring.
  - intros. lra.
  - intros c z _. now rewrite Id.
  - intros lines cs ts z w Ht N _ _. rewrite !Id. intros Hz Hw Azw Same Ex. apply square_root_bound with (r := real r);
      auto using square_in_nonneg.
    eapply Rle_trans; [apply MG|]. eapply part_holds; eauto using signs_of_lines.
  - intros. now apply way_within.
  - intros z. now rewrite Id.
  - intros. apply known_nothing.
Qed.
