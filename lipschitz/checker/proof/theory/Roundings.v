(** Accepted bounds on how far a float32 evaluation is from the exact function hold. *)
From Coq Require Import List ZArith Reals Lra Lia Bool Permutation.
From Swarmcert Require Import Algebra Activations Form Network Checker Fixed Float Meaning Steepness Sets Distance
    Blocks Lower Values Enclosures Intervals Centred Claims Slopes Witness Laws Ranges.
Import ListNotations.
Open Scope R_scope.
#[local] Arguments Z.add : simpl never.
#[local] Arguments Z.of_nat : simpl never.

Lemma close_length r x y : close r x y -> length x = length r /\ length y = length r.
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl;
    try tauto. intros [_ H]. destruct (IH _ _ H). auto.
Qed.
Lemma close_relu r x y : close r x y -> close r (map relu x) (map relu y).
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try tauto. intros [H G]. split; auto.
  eapply Rle_trans; [|exact H]. unfold relu, Rmax. repeat destruct (Rle_dec _ _); unfold Rabs;
    repeat destruct (Rcase_abs _); lra.
Qed.
Lemma close_square r x y : close r x y -> square (minus y x) <= square (reals r).
Proof.
  unfold square. revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try tauto; try lra.
  intros [H G]. specialize (IH _ _ G). unfold minus in IH |- *. simpl.
  replace (b + -1 * a) with (b - a) by ring. assert ((b - a) * (b - a) <= real e * real e); [|lra].
  rewrite <- (Rabs_pos_eq ((b - a) * (b - a))), Rabs_mult by (apply Rle_0_sqr). pose proof (Rabs_pos (b - a)).
  apply Rmult_le_compat; auto.
Qed.
(** Computed numbers are no larger than `sizes`. *)
Fixpoint no_larger (m : list dyadic) (x : list R) : Prop :=
  match m, x with a :: m', b :: x' => Rabs b <= real a /\ no_larger m' x' | [], [] => True | _, _ => False end.
Lemma sizes_no_larger b r x y : within b x -> close r x y -> no_larger (sizes b r) y.
Proof.
  revert r x y. induction b as [|[l h] b IH]; intros [|e r] [|a x] [|c y]; simpl; try tauto. intros [H G] [F K].
  split; eauto. rewrite real_add. pose proof (largest_abs_above (l, h) a H).
  assert (Rabs c <= Rabs (c - a) + Rabs a) by (replace c with ((c - a) + a) at 1 by ring; apply Rabs_triang). lra.
Qed.
Lemma row_total row h : total (timesR row h) = dotR row h.
Proof. revert h. induction row as [|a row IH]; intros [|b h]; simpl; auto. now rewrite IH. Qed.
Lemma row_size row m h : no_larger m h -> total_abs (timesR (reals row) h) <= real (dot zero add mul (map abs row) m).
Proof.
  revert m h. induction row as [|a row IH]; intros [|c m] [|b h]; simpl; try tauto; try (rewrite real_zero; lra).
  intros [H G]. rewrite real_add, real_mul, real_abs, Rabs_mult. specialize (IH _ _ G).
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real a)) H). unfold total_abs in *. lra.
Qed.
Lemma row_before row r x y : close r x y ->
  Rabs (dotR (reals row) y - dotR (reals row) x) <= real (dot zero add mul (map abs row) r).
Proof.
  revert r x y. induction row as [|w row IH]; intros [|e r] [|a x] [|b y]; simpl; try tauto;
    try (rewrite real_zero, Rminus_0_r, Rabs_R0; lra).
  intros [H G]. rewrite real_add, real_mul, real_abs. specialize (IH _ _ _ G).
  replace (real w * b + _ - _) with (real w * (b - a) + (dotR (reals row) y - dotR (reals row) x)) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult.
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real w)) H). lra.
Qed.
Lemma real_integer n : real (n, 0%Z) = IZR n. Proof. unfold real. simpl. ring. Qed.
Lemma length_times (row : list R) h : (length (timesR row h) <= length row)%nat.
Proof. revert h. induction row as [|a row IH]; intros [|b h]; simpl; try lia. specialize (IH h). lia. Qed.
Lemma size_length {A} (l : list A) : size l = Z.of_nat (length l).
Proof. induction l as [|a l IH]; auto. change (size (a :: l)) with (1 + size l)%Z. rewrite IH. cbn [length]. lia. Qed.
(** Sums whose order is known are among those in any order. *)
Lemma rounds_itself x : rounds x x.
Proof.
  intros _. rewrite Rminus_diag_eq, Rabs_R0 by reflexivity. pose proof roundoff_pos. pose proof tiny_pos.
  pose proof (Rmult_le_pos _ _ (Rlt_le _ _ H) (Rabs_pos x)). lra.
Qed.
Lemma ordered_is_sum a s v : added_in_order a s v -> forall l, float_sum l a -> float_sum (l ++ s) v.
Proof.
  intros H. induction H as [a|a s l p b v P B H IH|a s l b v B H IH]; intros k K.
  - now rewrite app_nil_r.
  - replace (k ++ s :: l) with ((k ++ [s]) ++ l) by now rewrite <- app_assoc. apply IH.
    eapply added; [exact K|apply summand, P|apply B].
  - replace (k ++ s :: l) with ((k ++ [s]) ++ l) by now rewrite <- app_assoc. apply IH.
    apply reordered with (s :: k); [apply Permutation_cons_append|]. apply fused with a; [exact K|apply B].
Qed.
Lemma any_rounding_covers n m d l v : any_rounding n m = Some d -> float_sum l v ->
  IZR (Z.of_nat (length l)) <= IZR n -> total_abs l <= real m -> Rabs (v - total l) <= real d.
Proof.
  unfold any_rounding. destruct (_ && _)%bool eqn:H; [|discriminate]. intros D F N M. inversion D. subst d. both H.
  apply Z.leb_le in H. apply at_most_real in H0.
  rewrite !real_add, real_mul in *. unfold gammaD in *. rewrite real_add, real_mul in *.
  assert (forall k, real (n, k) = IZR n * powerRZ 2 k) as E by reflexivity. rewrite !E in *.
  assert (powerRZ 2 (-24) = roundoff) as U.
  { unfold roundoff. change (powerRZ 2 (-24)) with (/ 2 ^ 24). f_equal. simpl. lra. }
  rewrite U in *. assert (real (1, 126)%Z = powerRZ 2 126) as X by (unfold real; cbn [fst snd]; ring). rewrite X in *.
  pose proof (float_error l v (IZR n) (real m) F ltac:(rewrite INR_IZR_INZ;
    exact N) ltac:(apply (IZR_le _ 8388608); lia) M H0) as R. lra.
Qed.
Lemma rounding_covers n m before e l v y : rounding_fits n m before e = true -> float_sum l v ->
  IZR (Z.of_nat (length l)) <= IZR n ->
  total_abs l <= real m -> Rabs (total l - y) <= real before -> Rabs (v - y) <= real e.
Proof.
  unfold rounding_fits. destruct (any_rounding n m) as [d|] eqn:D; [|discriminate]. intros H F N M B.
  apply at_most_real in H. rewrite real_add in H. pose proof (any_rounding_covers _ _ _ _ _ D F N M) as R.
  replace (v - y) with ((v - total l) + (total l - y)) by ring. eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma real_power k : real (1, k)%Z = powerRZ 2 k. Proof. unfold real. cbn [fst snd]. ring. Qed.
Lemma below_power m : is_positive m = true ->
  powerRZ 2 (snd m + Z.log2 (fst m)) <= real m <= powerRZ 2 (snd m + Z.log2 (fst m) + 1).
Proof.
  destruct m as [n e]. unfold is_positive. cbn [fst snd]. intros H. apply Z.ltb_lt in H.
  destruct (Z.log2_spec n H) as [L U]. pose proof (Z.log2_nonneg n) as P. unfold real. cbn [fst snd].
  rewrite <- Z.add_1_r in U. assert (0 < powerRZ 2 e) as Pe by (apply powerRZ_lt; lra).
  assert (forall k, (0 <= k)%Z -> IZR (2 ^ k) = powerRZ 2 k) as E.
  { intros k Hk. rewrite <- (Z2Nat.id k) by auto. rewrite <- pow_IZR. now rewrite <- pow_powerRZ. }
  replace (e + Z.log2 n + 1)%Z with ((Z.log2 n + 1) + e)%Z by ring.
  rewrite (Z.add_comm e), !powerRZ_add with (m := e) by lra. rewrite <- (E (Z.log2 n)), <- (E (Z.log2 n + 1)%Z) by lia.
  split; apply Rmult_le_compat_r; try lra; apply IZR_le; lia.
Qed.
Lemma one_rounding_covers s v m : rounds_closely s v -> Rabs s <= real m -> real m <= real (1, 126)%Z ->
  Rabs (v - s) <= real (one_rounding m).
Proof.
  intros [R H] S M. rewrite real_power in M. unfold one_rounding. destruct (is_positive m) eqn:P.
  - destruct (below_power m P) as [L U]. set (k := (snd m + Z.log2 (fst m))%Z) in *.
    assert (k <= 126)%Z as K.
    { destruct (Z.le_gt_cases k 126) as [G|G]; auto. exfalso.
      assert (powerRZ 2 127 <= powerRZ 2 k) as Q.
      { replace k with (127 + Z.of_nat (Z.to_nat (k - 127)))%Z by lia. rewrite powerRZ_add, <- pow_powerRZ by lra.
        assert (0 < powerRZ 2 127) by (apply powerRZ_lt; lra).
        pose proof (pow_R1_Rle 2 (Z.to_nat (k - 127)) ltac:(lra)). nra. }
      assert (powerRZ 2 127 = 2 * powerRZ 2 126) as Y by (change 127%Z with (1 + 126)%Z; rewrite powerRZ_add by lra;
        rewrite powerRZ_1; ring).
      assert (0 < powerRZ 2 126) by (apply powerRZ_lt; lra). lra. }
    pose proof (H (k + 1)%Z ltac:(lia) ltac:(lra)) as Q. rewrite real_add, !real_power.
    replace (k - 24)%Z with (k + 1 - 25)%Z by ring. exact Q.
  - assert (real m <= 0) as N.
    { unfold is_positive in P. apply Z.ltb_ge in P. unfold real.
      assert (0 < powerRZ 2 (snd m)) by (apply powerRZ_lt; lra). apply IZR_le in P. nra. }
    pose proof (Rabs_pos s). assert (Rabs s = 0) as Z by lra. rewrite real_power.
    pose proof (R ltac:(rewrite Z; apply powerRZ_le; lra)) as Q. rewrite Z, Rmult_0_r in Q. unfold tiny in Q. lra.
Qed.
Lemma one_rounding_nonneg m : 0 <= real (one_rounding m).
Proof.
  assert (forall k, 0 <= powerRZ 2 k) as P by (intros k; apply powerRZ_le; lra).
  unfold one_rounding. destruct (is_positive m); rewrite ?real_add, !real_power;
    repeat apply Rplus_le_le_0_compat; apply P.
Qed.
Lemma product_between w i x : real (fst i) <= x <= real (snd i) ->
  let p := if is_nonnegative w then (mul w (fst i), mul w (snd i)) else (mul w (snd i), mul w (fst i)) in
  real (fst p) <= real w * x <= real (snd p).
Proof.
  intros [L H]. destruct (is_nonnegative w) eqn:N; cbn [fst snd]; rewrite !real_mul.
  - apply real_nonnegative in N. split; apply Rmult_le_compat_l; auto.
  - assert (real w <= 0) by (apply Rlt_le; now apply negative_real). nra.
Qed.
Lemma ordered_covers row h x s off d exact a v : ordered_rounding row h s off = Some d -> within h x ->
  real (fst s) <= exact <= real (snd s) -> Rabs (a - exact) <= real off ->
  added_in_order a (timesR (reals row) x) v ->
  Rabs (v - (exact + total (timesR (reals row) x))) <= real d.
Proof.
  revert h x s off exact a. induction row as [|w row IH]; intros [|[l h] b] [|z x] s off exact a; try (simpl; tauto);
    try (simpl; intros H _ _ A F; inversion H; inversion F; subst; rewrite Rplus_0_r; exact A).
  intros H [Z W] S A F. cbn [ordered_rounding fst snd] in H.
  set (p := if is_nonnegative w then _ else _) in H.
  set (t := (add (fst s) (fst p), add (snd s) (snd p))) in H.
  set (e := add off (one_rounding (largest_abs p))) in H. set (m := add (largest_abs t) e) in H.
  destruct (at_most _ _) eqn:M; [|discriminate]. apply at_most_real in M. rewrite real_add in M.
  pose proof (product_between w (l, h) z Z) as P. cbv zeta in P. cbn [fst snd] in P. fold p in P.
  assert (real (fst t) <= exact + real w * z <= real (snd t)) as T
    by (unfold t; cbn [fst snd]; rewrite !real_add; lra).
  pose proof (largest_abs_above p _ P) as LP. pose proof (largest_abs_above t _ T) as LT.
  pose proof (Rabs_pos (real w * z)) as P0. pose proof (Rabs_pos (exact + real w * z)) as T0.
  pose proof (one_rounding_nonneg (largest_abs p)) as N. pose proof (Rabs_pos (a - exact)) as A0.
  assert (real e = real off + real (one_rounding (largest_abs p))) as E by (unfold e; apply real_add).
  assert (real m = real (largest_abs t) + real e) as Em by (unfold m; apply real_add).
  cbn [map timesR total fold_right] in F |- *. change (fold_right Rplus 0 ?l) with (total l).
  rewrite <- Rplus_assoc.
  assert (forall q c, Rabs (q - (exact + real w * z)) <= real e -> rounds_closely q c ->
    Rabs (c - (exact + real w * z)) <= real (ceil_to (-160) (add e (one_rounding m)))) as K.
  { intros q c Q R. eapply Rle_trans; [|apply ceil_to_above]. rewrite real_add.
    assert (Rabs q <= real m) as Hq.
    { replace q with ((q - (exact + real w * z)) + (exact + real w * z)) by ring.
      eapply Rle_trans; [apply Rabs_triang|]. lra. }
    pose proof (one_rounding_covers q c m R Hq ltac:(lra)) as O.
    replace (c - (exact + real w * z)) with ((c - q) + (q - (exact + real w * z))) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. lra. }
  inversion F as [|? ? ? q c ? Hq Hc F'|? ? ? c ? Hc F']; subst.
  - eapply IH; eauto. apply (K (a + q)); auto.
    pose proof (one_rounding_covers _ _ (largest_abs p) Hq LP ltac:(lra)) as O.
    replace (a + q - (exact + real w * z)) with ((a - exact) + (q - real w * z)) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. lra.
  - eapply IH; eauto. apply (K (real w * z + a)); auto.
    replace (real w * z + a - (exact + real w * z)) with (a - exact) by ring. lra.
Qed.
Lemma widened_within b r x y : within b x -> close r x y -> within (widened b r) y.
Proof.
  revert r x y. induction b as [|[l h] b IH]; intros [|e r] [|a x] [|c y]; simpl; try tauto. intros [H G] [F K].
  split; [|now apply (IH r x)]. rewrite !real_add, real_neg. revert F. unfold Rabs. destruct (Rcase_abs _); lra.
Qed.
Lemma roundings_hold o w c h m ds x v : layer_roundings o w c h m = Some ds -> no_larger m x -> within h x ->
  float_layer o (realm w, reals c) x v -> close ds (affine (realm w) (reals c) x) v.
Proof.
  intros H S W. unfold float_layer. simpl. revert c ds v H. induction w as [|row w IH]; intros [|a c] ds v; simpl;
    try discriminate.
  - intros H F. inversion H. inversion F. exact I.
  - set (one := if o then _ else _). destruct one as [d|] eqn:D; [|discriminate].
    destruct (layer_roundings o w c h m) as [ds'|] eqn:E; [|discriminate]. intros H F. inversion H. subst ds.
    inversion F as [|? y ? v' Fy Fv]; subst. simpl in Fy. split; [|now apply (IH _ _ _ E)]. unfold one in D.
    rewrite <- row_total. destruct o.
    + replace (total _ + real a) with (real a + total (timesR (reals row) x)) by ring.
      eapply (ordered_covers _ _ _ (a, a) zero); eauto; cbn [fst snd]; [lra|].
      rewrite Rminus_diag_eq, Rabs_R0, real_zero by reflexivity. lra.
    + replace (total _ + real a) with (total (real a :: timesR (reals row) x)) by (simpl; ring).
      eapply any_rounding_covers; [exact D|exact Fy| |].
      * apply IZR_le. rewrite size_length. cbn [length]. pose proof (length_times (reals row) x) as L.
        rewrite map_length in L. lia.
      * simpl. rewrite real_add, real_abs. pose proof (row_size row m x S). lra.
Qed.
Lemma errors_close w c r ds e x h v : errors_fit w r ds e = true -> close r x h -> length c = length w ->
  close ds (affine (realm w) (reals c) h) v -> close e (affine (realm w) (reals c) x) v.
Proof.
  intros H C. revert c ds e v H. induction w as [|row w IH]; intros [|a c] [|d ds] [|z e] [|y v]; simpl;
    try discriminate; try tauto.
  intros H L [G K]. both H. split; [|apply (IH c ds); auto].
  apply at_most_real in H. rewrite real_add in H. pose proof (row_before row r x h C) as B.
  match goal with |- Rabs (y - ?q) <= _ => match type of G with Rabs (y - ?p) <= _ =>
    replace (y - q) with ((y - p) + (p - q)) by ring end end.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [|exact H].
  match goal with |- _ + Rabs ?t <= _ => replace t with (dotR (reals row) h - dotR (reals row) x) by ring end. lra.
Qed.
Lemma roundings_length o w c h m ds : layer_roundings o w c h m = Some ds -> length c = length w.
Proof.
  revert c ds. induction w as [|row w IH]; intros [|a c] ds; simpl; try discriminate; auto.
  destruct (if o then _ else _); [|discriminate]. destruct (layer_roundings o w c h m) eqn:E; [|discriminate].
  intros _. f_equal. eapply IH; eauto.
Qed.
(** One layer: number by number relative to x, and in norm relative to any y that is near to the computed input. *)
Lemma layer_error o (l : layerD) b r n off u ds s x h y v :
  layer_roundings o (fst l) (snd l) (widened b r) (sizes b r) = Some ds -> errors_fit (fst l) r ds s = true ->
  norm_fits n off u ds = true -> norm_bound_of l (real n) -> within b x -> close r x h -> length y = length h ->
  norm (minus h y) <= real off -> float_layer o (real_layer l) h v ->
  let exact := affine (fst (real_layer l)) (snd (real_layer l)) in
  close s (exact x) v /\ length v = length (exact y) /\ norm (minus v (exact y)) <= real u.
Proof.
  destruct l as [w c]. intros D E N B W C Ly Y F. cbn [fst snd] in *. cbv zeta.
  pose proof (roundings_length _ _ _ _ _ _ D) as Lc.
  pose proof (roundings_hold _ _ _ _ _ _ _ _ D (sizes_no_larger _ _ _ _ W C) (widened_within _ _ _ _ W C) F) as R.
  split; [now apply (errors_close _ _ r ds _ _ h)|]. destruct (close_length _ _ _ R) as [L1 L2].
  assert (forall z, length (affine (realm w) (reals c) z) = length w) as La
    by (intros z; rewrite length_affine; now rewrite ?map_length).
  simpl. rewrite La in *. split; [congruence|].
  unfold norm_fits in N. both N. apply real_nonnegative in N. apply at_most_real in H.
  rewrite real_add, real_neg, real_mul in N. rewrite real_square, real_mul, real_add, real_neg, real_mul in H.
  rewrite (minus_through v (affine (realm w) (reals c) h)) by (rewrite ?La; congruence).
  eapply Rle_trans; [apply norm_plus|].
  assert (norm (minus v (affine (realm w) (reals c) h)) <= real u + - (real n * real off)) as P.
  { apply sqrt_below; auto. pose proof (close_square _ _ _ R). lra. }
  pose proof (affine_bound (w, c) (real n) h y B Lc) as Q. simpl in Q. destruct B as [B0 _].
  pose proof (Rmult_le_compat_l (real n) _ _ B0 Y). lra.
Qed.
Lemma roundings_close o hid last b r bounds errors e ns off offs u x h y v :
  check_roundings o hid last b r bounds errors e ns off offs u = true ->
  Forall2 norm_bound_of (hid ++ [last]) (reals ns) -> within b x -> close r x h -> length y = length h ->
  norm (minus h y) <= real off -> float_network o (map real_layer hid) (real_layer last) h v ->
  close e (network (relu_layers hid) (real_layer last) x) v /\
  length v = length (network (relu_layers hid) (real_layer last) y) /\
  norm (minus v (network (relu_layers hid) (real_layer last) y)) <= real u.
Proof.
  revert b r bounds errors ns off offs x h y.
  induction hid as [|l hid IH]; intros b r [|v' bounds] [|s errors] [|n ns] off [|z offs] x h y; simpl;
    try discriminate; try (destruct ns; discriminate).
  - destruct ns; [|discriminate]. destruct (layer_roundings _ _ _ _ _) as [ds|] eqn:D; [|discriminate].
    intros H B W C Ly Y F. both H. inversion B; subst. eapply layer_error; eauto.
  - intros H B W C Ly Y (q & Fq & F). do 2 both H. inversion B as [|? ? ? ? Bl B']; subst.
    destruct (layer_roundings _ _ _ _ _) as [ds|] eqn:D; [|discriminate]. both H1.
    destruct (layer_error _ _ _ _ _ _ _ _ _ _ _ _ _ D H1 H2 Bl W C Ly Y Fq) as (Q1 & Q2 & Q3).
    eapply (IH _ _ _ _ _ _ _ _ (map relu q)); eauto.
    + apply relu_within. eapply encloses_within; eauto.
    + now apply close_relu.
    + now rewrite !map_length.
    + pose proof (activated_contracts Relu _ _ Q2) as A. simpl in A. rewrite real_one, Rmult_1_l in A.
      eapply Rle_trans; [exact A|exact Q3].
Qed.
Lemma list_norms_sound ps accepted p : Forall (holds ps) accepted ->
  forall ls us before, layers (part_at ps p) = before ++ ls -> list_norms accepted p (length before) ls = Some us ->
  Forall2 norm_bound_of ls (reals us).
Proof.
  intros HA ls. induction ls as [|l ls IH]; intros us before E; simpl.
  - intros H. inversion H. constructor.
  - destruct (find_norm accepted p (length before)) as [u|] eqn:Hu; [|discriminate].
    destruct (list_norms accepted p (S (length before)) ls) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative u) eqn:Hn; [|discriminate]. intros H. inversion H. subst. simpl. constructor.
    + split; [now apply real_nonnegative|]. intros d. pose proof (find_norm_sound _ _ _ _ _ HA Hu d) as F.
      unfold weights_at in F. rewrite E, nth_middle in F. exact F.
    + apply (IH w (before ++ [l])).
      * now rewrite <- app_assoc.
      * now rewrite app_length, Nat.add_comm.
Qed.
Lemma unclamped_slope_sound ps accepted p k x y : Forall (holds ps) accepted -> fits_part (part_at ps p) = true ->
  unclamped_slope ps accepted p = Some k -> length x = inputs_of (part_at ps p) -> length y = length x ->
  norm (minus (unclamped (part_at ps p) x) (unclamped (part_at ps p) y)) <= real k * norm (minus x y).
Proof.
  intros HA F. unfold unclamped_slope. destruct (clamp (part_at ps p)) eqn:C; simpl is_nil; cbn iota.
  - destruct (find_alone _ _ _) as [u|] eqn:E.
    + intros H Lx Ly. inversion H. subst u. destruct (find_alone_sound _ _ _ _ _ HA E) as (moves & A & Lm & S).
      pose proof (S [] x y (agree_all moves x y A ltac:(congruence) ltac:(congruence)) Lx) as B.
      simpl value_of in B. unfold value, distance in B. rewrite square_in_one, C in B. exact B.
    + intros H _ _. now apply (part_bound ps accepted).
  - intros H _ _. now apply (part_bound ps accepted).
Qed.
Lemma error_sound ps accepted o p b r e u bounds errors moved offs made : Forall (holds ps) accepted ->
  check_error ps accepted o p b r e u bounds errors moved offs made = true -> holds ps (Float_error o p b r e u).
Proof.
  intros HA. unfold check_error. intros H. do 2 both H.
  destruct (list_norms _ _ _ _) as [ns|] eqn:N; [|discriminate].
  destruct (unclamped_slope _ _ _) as [k|] eqn:K; [|discriminate]. do 6 both H0.
  split; [now apply relu_part|]. intros x v Hx (h & C & F).
  rename H2 into G, H3 into Lr, H4 into Sr, H5 into Pm, H6 into Pk, H7 into Pu, H1 into Fp.
  apply real_nonnegative in Pu, Pk, Pm. apply at_most_real in Sr. apply Nat.eqb_eq in Lr.
  pose proof (list_norms_sound _ _ _ HA _ _ [] eq_refl N) as B. unfold layers in B.
  destruct (close_length _ _ _ C) as [Lx Lh].
  assert (norm (minus h h) <= real zero) as Z.
  { rewrite real_zero. apply sqrt_below; [lra|]. rewrite Rmult_0_l.
    assert (minus h h = repeat 0 (length h)) as ->.
    { unfold minus. clear. induction h as [|a h IH]; simpl; auto. rewrite IH. f_equal. ring. }
    unfold square. clear. induction (length h); simpl; lra. }
  destruct (roundings_close _ _ _ _ _ _ _ _ _ _ _ _ _ _ _ _ H0 B (within_clamped _ _ _ Hx) C eq_refl Z F)
    as (Q1 & Q2 & Q3).
  assert (close e (value (part_at ps p) x) v) as Q by (unfold value; now rewrite relu_network).
  split; auto. apply orb_prop in G. destruct G as [G|G]; apply at_most_real in G.
  - apply sqrt_below; auto. rewrite real_square, real_mul in G. pose proof (close_square _ _ _ Q). lra.
  - rewrite real_add, real_mul in G. destruct (close_length _ _ _ Q) as [Lv Lw].
    rewrite <- relu_network in Q2, Q3 by auto.
    pose proof (unclamped_slope_sound _ _ _ _ h (clamped (clamp (part_at ps p)) x) HA Fp K ltac:(congruence)
      ltac:(congruence)) as S.
    rewrite (minus_through v (unclamped (part_at ps p) h)) by (unfold value in *; congruence).
    eapply Rle_trans; [apply norm_plus|].
    assert (norm (minus h (clamped (clamp (part_at ps p)) x)) <= real moved) as M.
    { apply sqrt_below; auto. rewrite real_square, real_mul in Sr. pose proof (close_square _ _ _ C). lra. }
    unfold value. pose proof (Rmult_le_compat_l (real k) _ _ Pk M). lra.
Qed.
Lemma find_error_sound o ps accepted p b r e u : Forall (holds ps) accepted ->
  find_error o accepted p b r = Some (e, u) ->
  holds ps (Float_error o p b r e u).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl find_error; auto.
  destruct (eqb o in_order) eqn:O; simpl; auto. apply eqb_prop in O. subst in_order.
  destruct (Nat.eqb_spec p p0); simpl; auto. destruct (same_box b b0) eqn:E; simpl; auto.
  destruct (same_numbers r r0) eqn:G; auto. apply same_box_eq in E. apply same_numbers_eq in G.
  intros K. inversion K. subst. exact Hc.
Qed.

(** Sums: coordinate by coordinate. *)
Lemma close_nth r x y i : close r x y -> (i < length r)%nat -> Rabs (nth i y 0 - nth i x 0) <= real (nth i r zero).
Proof.
  revert r x y. induction i as [|i IH]; intros [|e r] [|a x] [|b y]; simpl; try tauto; try lia; intros [H G] L; auto.
  apply IH; auto. lia.
Qed.
Lemma nth_close r x y : length x = length r -> length y = length r ->
  (forall i, (i < length r)%nat -> Rabs (nth i y 0 - nth i x 0) <= real (nth i r zero)) -> close r x y.
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try discriminate; auto. intros Hx Hy H. split.
  - apply (H O). lia.
  - apply IH; try lia. intros i Hi. apply (H (S i)). lia.
Qed.
Lemma no_larger_nth m x i : no_larger m x -> (i < length m)%nat -> Rabs (nth i x 0) <= real (nth i m zero).
Proof.
  revert m x. induction i as [|i IH]; intros [|a m] [|b x]; simpl; try tauto; try lia; intros [H G] L; auto.
  apply IH; auto. lia.
Qed.
Lemma nth_plusR i u v : nth i (plusR u v) 0 = nth i u 0 + nth i v 0.
Proof. revert i v. induction u as [|a u IH]; intros [|i] [|b v]; simpl; try ring; auto. Qed.
Lemma nth_plusD i u v : real (nth i (plus add u v) zero) = real (nth i u zero) + real (nth i v zero).
Proof.
  revert i v. induction u as [|a u IH]; intros [|i] [|b v]; simpl; rewrite ?real_zero; try ring; auto using real_add.
Qed.
Lemma nth_scaleD i k u : (i < length u)%nat -> real (nth i (scale mul k u) zero) = real k * real (nth i u zero).
Proof. revert i. induction u as [|a u IH]; intros [|i] L; simpl in *; try lia; [apply real_mul|]. apply IH. lia. Qed.
Lemma nth_zeros i n : nth i (zeros n) 0 = 0.
Proof. unfold zeros. revert i. induction n; intros [|i]; simpl; auto. Qed.
Lemma total_nth i us : total (map (fun u => nth i u 0) us) = nth i (vector_sum us) 0.
Proof. induction us as [|u us IH]; simpl; [now destruct i|]. now rewrite IH, nth_plusR. Qed.
Lemma sizes_length b r : length (sizes b r) = min (length b) (length r).
Proof. revert r. induction b as [|[l h] b IH]; intros [|a r]; simpl; auto. Qed.
Lemma all_nth_nonneg e i : forallb is_nonnegative e = true -> 0 <= real (nth i e zero).
Proof.
  revert i. induction e as [|a e IH]; intros [|i]; simpl; rewrite ?real_zero; try lra; intros H; both H; auto.
  now apply real_nonnegative.
Qed.

Definition computed_fit o ps (t_xs : term * list dyadic * list (list R)) vs :=
  Forall2 (evaluates o (part_at ps (phi (fst (fst t_xs)))) (snd (fst t_xs))) (snd t_xs) vs.
Lemma group_errors o ps p (b v : box) r e u n xs vs i : holds ps (Within p b v) -> holds ps (Float_error o p b r e u) ->
  length v = n -> length e = n -> (i < n)%nat -> Forall (within b) xs -> Forall2 (evaluates o (part_at ps p) r) xs vs ->
  length vs = length xs /\
  total_abs (map (fun u => nth i u 0) vs) <= INR (length xs) * real (nth i (sizes v e) zero) /\
  Rabs (total (map (fun u => nth i u 0) vs) - total (map (fun u => nth i u 0) (map (value (part_at ps p)) xs)))
    <= INR (length xs) * real (nth i e zero).
Proof.
  intros HW HE Lv Le Hi HF H. induction H as [|x y xs vs Hxy H IH].
  - simpl. rewrite Rminus_0_r, Rabs_R0. split; auto. lra.
  - inversion HF as [|? ? Hx HF']; subst. destruct (IH HF') as (L & M & E). destruct (proj2 HE x y Hx Hxy) as [C _].
    assert (i < length (sizes v e))%nat as Is by (rewrite sizes_length; lia).
    pose proof (no_larger_nth _ _ i (sizes_no_larger _ _ _ _ (HW x Hx) C) Is) as S.
    pose proof (close_nth _ _ _ i C ltac:(lia)) as D.
    cbn [length map total total_abs fold_right]. fold (total (map (fun u => nth i u 0) vs)).
    fold (total_abs (map (fun u => nth i u 0) vs)). rewrite S_INR. split; [lia|]. split; [lra|].
    change (fold_right Rplus 0 ?l) with (total l).
    replace (nth i y 0 + _ - _) with ((nth i y 0 - nth i (value (part_at ps p) x) 0) +
      (total (map (fun u => nth i u 0) vs) - total (map (fun u => nth i u 0) (map (value (part_at ps p)) xs))))
        by ring.
    eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma sum_errors_sound o ps accepted n terms count m s inputs computed i : Forall (holds ps) accepted ->
  sum_errors o accepted n terms = Some (count, m, s) -> Forall2 may_stand (map fst terms) inputs ->
  Forall2 (computed_fit o ps) (combine terms inputs) computed -> (i < n)%nat ->
  IZR (Z.of_nat (S (length (concat computed)))) <= IZR count /\
  total_abs (map (fun u => nth i u 0) (concat computed)) <= real (nth i m zero) /\
  Rabs (total (map (fun u => nth i u 0) (concat computed)) - total (map (fun u => nth i u 0)
    (flat_map (fun g => map (value (part_at ps (phi (fst g)))) (snd g)) (combine (map fst terms) inputs)))) <= real
      (nth i s zero).
Proof.
  intros HA. revert count m s inputs computed. induction terms as [|[[p b low high] r] terms IH];
    intros count m s inputs computed.
  - simpl. intros H M F Hi. inversion H. inversion M. subst. inversion F. simpl.
    rewrite Rminus_0_r, Rabs_R0, !nth_repeat, !real_zero. repeat split; try lra. apply IZR_le. lia.
  - simpl sum_errors. destruct (find_within accepted p b) as [v|] eqn:Ev; [|discriminate].
    destruct (find_error o accepted p b r) as [[e u]|] eqn:Ee; [|discriminate].
    destruct (sum_errors o accepted n terms) as [[[count' m'] s']|] eqn:Es; [|discriminate].
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros H M F Hi. inversion H. subst count m s. clear H.
    inversion M as [|? xs ? inputs' [K B] M']; subst. simpl combine in F. inversion F as [|? vs ? computed' G F'];
      subst.
    do 3 both C. apply Nat.eqb_eq in C, H1. apply Z.leb_le in H0.
    destruct (IH _ _ _ _ _ eq_refl M' F' Hi) as (N & S & D). unfold computed_fit in G. simpl in G, K, B.
    destruct (group_errors o ps p b v r e u n xs vs i (find_within_sound _ _ _ _ _ HA Ev) (find_error_sound _ _ _ _ _
      _ _ _ HA Ee)
      C H1 Hi B G) as (L1 & S1 & D1).
    assert (INR (length xs) <= IZR high) as Hn by (rewrite INR_IZR_INZ; apply IZR_le; lia).
    assert (i < length (sizes v e))%nat as Is by (rewrite sizes_length; lia).
    pose proof (all_nth_nonneg e i H) as Pe.
    assert (0 <= real (nth i (sizes v e) zero)) as Pm.
    { destruct xs as [|x xs].
      - clear - Is H Pe. revert v e i Is H Pe. induction v as [|j v IHv]; intros [|a e] [|i]; simpl; try lia;
        intros Is H Pe.
        + rewrite real_add. both H. apply real_nonnegative in H. unfold largest_abs. rewrite real_larger, !real_abs.
          pose proof (Rabs_pos (real (fst j))). pose proof (Rmax_l (Rabs (real (fst j))) (Rabs (real (snd j)))). lra.
        + both H. apply IHv; auto. lia.
      - assert (within b x) as Hx by (inversion B; auto). inversion G as [|? y ? ? Hy _]; subst.
        destruct (proj2 (find_error_sound _ _ _ _ _ _ _ _ HA Ee) x y Hx Hy) as [Cl _].
        pose proof (no_larger_nth _ _ i (sizes_no_larger _ _ _ _ (find_within_sound _ _ _ _ _ HA Ev x Hx) Cl) Is)
          as Q.
        pose proof (Rabs_pos (nth i y 0)). lra. }
    cbn [concat map combine flat_map fst snd phi]. rewrite !map_app, total_app, total_app, total_abs_app, app_length.
    rewrite !nth_plusD, !nth_scaleD, !real_integer by lia. split; [|split].
    + apply le_IZR in N. apply IZR_le. lia.
    + pose proof (Rmult_le_compat_r _ _ _ Pm Hn). lra.
    + pose proof (Rmult_le_compat_r _ _ _ Pe Hn).
      match goal with |- Rabs (?a + ?b - (?c + ?d)) <= _ => replace (a + b - (c + d)) with ((a - c) + (b - d))
        by ring end.
      eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma terms_relu o ps accepted n terms sums : Forall (holds ps) accepted -> sum_errors o accepted n terms = Some sums ->
  Forall (fun t => all_relu (part_at ps (phi (fst t)))) terms.
Proof.
  intros HA. revert sums. induction terms as [|[[p b low high] r] terms IH]; intros sums; [constructor|]. simpl.
  destruct (find_within accepted p b); [|discriminate].
  destruct (find_error o accepted p b r) as [[e u]|] eqn:Ee; [|discriminate].
  destruct (sum_errors o accepted n terms); [|discriminate]. intros _. constructor; [|now eapply IH].
  apply (find_error_sound _ _ _ _ _ _ _ _ HA Ee).
Qed.
Lemma sum_fits_nth count m e errors i : sum_fits count m e errors = true -> (i < length errors)%nat ->
  rounding_fits count (nth i m zero) (nth i e zero) (nth i errors zero) = true.
Proof.
  revert m e errors. induction i as [|i IH]; intros [|a m] [|b e] [|x errors]; simpl; try discriminate; try lia;
    intros H L;
    both H; auto. apply IH; auto. lia.
Qed.
Lemma sum_error_sound ps accepted o terms rho u sums errors : Forall (holds ps) accepted ->
  check_sum_error ps accepted o terms rho u sums errors = true -> holds ps (Sum_float_error o terms rho u).
Proof.
  intros HA. unfold check_sum_error. set (n := inputs_of (part_at ps rho)).
  destruct (sum_ends _ _ _) as [s|] eqn:Es; [|discriminate].
  destruct (sum_errors _ _ _ _) as [[[count m] e]|] eqn:Ee; [|discriminate].
  destruct (find_error _ _ _ _ _) as [[e' w]|] eqn:Ew; [|discriminate].
  intros H. split; [apply (find_error_sound _ _ _ _ _ _ _ _ HA Ew)|]. split; [eapply terms_relu; eauto|].
  intros inputs computed z v M F [Lz S] N. do 4 both H. rename H0 into Hw, H1 into Hf, H2 into Hl, H3 into Hc.
  apply Nat.eqb_eq in Hl. apply at_most_real in Hw.
  pose proof (sum_ends_sound _ _ _ _ _ _ HA Es M) as W. apply (contains_within _ _ _ H) in W.
  set (exact := sum_of_terms ps rho (combine (map fst terms) inputs)) in *.
  assert (evaluates o (part_at ps rho) errors exact v) as EV;
    [|destruct (proj2 (find_error_sound _ _ _ _ _ _ _ _ HA Ew) exact v W EV) as [_ B]; lra].
  exists z. split; auto. destruct (clamp (part_at ps rho)) eqn:E; [|discriminate]. simpl clamped.
  assert (length exact = n) as Lx.
  { pose proof (within_length _ _ (sum_ends_sound _ _ _ _ _ _ HA Es M)) as X. fold exact in X. rewrite X.
    eapply length_sum_ends; eauto. }
  apply nth_close; [now rewrite Hl|now rewrite Hl|]. intros i Hi. rewrite Hl in Hi.
  destruct (sum_errors_sound _ _ _ _ _ _ _ _ _ _ i HA Ee M F Hi) as (C1 & C2 & C3).
  eapply rounding_covers; [apply sum_fits_nth; [exact Hf|lia]|apply S; exact Hi| | |].
  - simpl length. rewrite map_length. exact C1.
  - simpl. rewrite Rabs_R0. lra.
  - simpl total. rewrite Rplus_0_l. unfold exact, sum_of_terms. fold n. simpl vector_sum.
    rewrite nth_plusR, nth_zeros, Rplus_0_l, <- total_nth. exact C3.
Qed.
